/// One shot into the receivers of one cell: analytic form factors, shadow rays in the own cell, bitmap for foreign ones.
///
/// Per cluster of 16 receivers the shooter is seen as a whole group from afar, as patches nearer by, and element by element,
/// with signed unshot radiosity, when it is about as near as it is large (numerics: near field, hierarchical shooters).
#pragma once

#include <vector>

#include "core/light/cell_light.hpp"
#include "core/light/item_visibility.hpp"
#include "core/light/radiosity.hpp"
#include "core/light/raycast.hpp"
#include "core/light/receiver_tree.hpp"

namespace lichthof {

/// A polygon that shoots one value, in the cell's local frame.
struct FlatSource {
  FlatShooter flat;
  Aim16 aim;
  float reflected[3] = {};  ///< unshot radiosity without emission (W/m²), signed
  float emitted[3] = {};    ///< own emission (W/m²): arrives as direct light
  float radius = 0;         ///< m
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

struct TransferScene {
  const Mesh& mesh;
  const ReceiverTree& tree;
  const RayScene& rays;
  const std::vector<FlatOccluder>& occluders;  ///< the surfaces of the cell, index as RayScene's hits
  const ElementOutlines& outlines;               ///< only for the method `hemicube`
  const TransferOptions& options;
  const Vec3& origin;
};

/// Adds the shot to `light`. @param incoming bitmap of nearer cells, nullptr in the shooter's own cell
/// @cost  about 0.3 µs per visible cluster, nearly all of it the kernel of the shadow rays
TransferWork transfer(const Shot& shot, const HemicubeBitmap* incoming, const TransferScene& scene, Radiosity& light,
                      const Parallel& parallel);

}  // namespace lichthof
