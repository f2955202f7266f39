/// The elements of a solution as polygons with values at their corners: what a model file shows.
#pragma once

#include <cstdint>
#include <vector>

#include "core/light/solution.hpp"

namespace lichthof::io {

/// Outgoing radiosity of an element (W/m²): emission plus reflected irradiance, the light still to come included.
Rgb element_radiosity(const Solution& solution, const Patch& patch, std::size_t element);

/// Element polygons with shared corners. Corners in the same place of the same plane and material are one vertex; its
/// irradiance is the mean of the elements around it in the plane, so colours run smoothly over a wall and stop at its edges.
struct ElementModel {
  struct Vertex {
    Vec3 position;       ///< world (m)
    Vec3 normal;         ///< towards the lit side
    Rgb radiosity{0.0};  ///< W/m²
  };
  struct Face {
    std::uint32_t first = 0, count = 0;  ///< range of corners, counter-clockwise from the lit side
    std::uint32_t material = 0;
  };
  std::vector<Vertex> vertices;
  std::vector<std::uint32_t> corners;  ///< indices into vertices
  std::vector<Face> faces;
};

/// Fronts and backs are faces of their own. @cost O(n log n)
ElementModel element_model(const Solution& solution);

}  // namespace lichthof::io
