/// A shot as a cell sees it: in its local frame, at three levels of detail, with the points that its shadow rays aim at.
#pragma once

#include <vector>

#include "core/light/cell_light.hpp"
#include "core/light/occluders.hpp"

namespace lichthof {

/// A polygon that shoots one value, in the cell's local frame.
struct FlatSource {
  FlatShooter flat;
  Aim16 aim;
  float reflected[3] = {};  ///< unshot radiosity without emission (W/m²), signed
  float emitted[3] = {};    ///< own emission (W/m²): arrives as direct light
  float radius = 0;         ///< m
  FlatBox box;              ///< around the polygon
};

/// A shot brought into a cell's local frame, at its three levels of detail.
struct LocalShot {
  FlatSource group;
  std::vector<FlatSource> patches;
  std::vector<FlatSource> elements;
  std::vector<std::uint32_t> first_element;  ///< per patch, one more than patches
  bool reflects = false, emits = false;      ///< any of it is not zero
};

LocalShot local_shot(const Shot& shot, const Vec3& origin);

}  // namespace lichthof
