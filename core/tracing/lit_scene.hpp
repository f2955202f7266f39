/// A scene with the first pass's solution, ready for the second: everything a worker holds (§3: "the scene description is
/// stored on every processor"). Built once per process and shared.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "core/light/solution.hpp"
#include "core/tracing/direct_light.hpp"
#include "core/tracing/irradiance_field.hpp"
#include "core/tracing/trace_scene.hpp"

namespace lichthof {

class LitScene {
 public:
  /// Without a solution: enough for the methods `raytrace` and `reference`; every field is zero.
  explicit LitScene(std::shared_ptr<const Scene> scene);
  /// @pre the arrays of the solution have one entry per element
  /// @cost about 5 µs per element
  explicit LitScene(const Solution& solution);

  const TraceScene& trace() const { return *trace_; }
  const std::shared_ptr<const TraceScene>& shared_trace() const { return trace_; }
  const DirectLight& direct() const { return *direct_; }
  bool has_solution() const { return geometry_ != nullptr; }
  const Mesh& mesh() const { return geometry_->mesh(); }  ///< @pre has_solution()

  /// Interpolated irradiance on a surface side (W/m²): all light, or without what came straight from luminaires.
  Rgb total_irradiance(const SurfacePoint& at) const;
  Rgb indirect_irradiance(const SurfacePoint& at) const;

  /// Radiosity that a surface side reflects at a point, without emission (W/m²): ρ(H + pending). Constant over an element
  /// where that does no harm, interpolated near contact lines and for close looks.
  Rgb reflected_radiosity(const SurfacePoint& at, double distance) const;
  /// Whether bright light straight from a luminaire falls so unevenly there that an element can't tell it: along the edge of a spot that a
  /// lamp near by throws, or of the sun's. @pre has_solution()
  bool is_edge_of_spot(const SurfacePoint& at) const;
  bool has_elements(const SurfacePoint& at) const;
  /// Of the element there (m), root of its area, but not above the usual one; 0 where there is none.
  double element_size(const SurfacePoint& at) const;
  double element_size() const { return element_size_; }  ///< m; the mesh's usual one, 0 without a solution

  /// How bright it is where most light is reflected: mean of the reflected radiosity, weighed by itself (W/m²); 0 without a solution.
  Rgb bright_radiosity() const { return bright_radiosity_; }

  /// Area mean of the indirect irradiance (W/m²): the constant ambient term of plain ray tracing.
  Rgb mean_indirect() const { return mean_indirect_; }
  /// Without the scene itself and its mesh (bytes).
  std::size_t memory_bytes() const;

 private:
  std::shared_ptr<const TraceScene> trace_;
  std::shared_ptr<const DirectLight> direct_;
  std::shared_ptr<const FieldGeometry> geometry_;
  std::unique_ptr<const IrradianceField> total_, indirect_;
  std::vector<Rgbf> reflected_;
  std::vector<std::uint8_t> is_edge_of_spot_;  ///< by element
  void find_edges_of_spots(const Solution& solution);
  double element_size_ = 0;
  Rgb mean_indirect_{0.0}, bright_radiosity_{0.0};
};

/// The constant ambient irradiance (W/m²) of a scene without a solution: what a closed scene of the same surfaces would have
/// on average, ρ Φ / ((1 - ρ) S), with ρ the area's mean reflectance, Φ the emitted power, S the area.
/// @source exact for closed scenes of uniform ρ
Rgb estimated_ambient(const Scene& scene);

}  // namespace lichthof
