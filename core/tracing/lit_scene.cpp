#include "core/tracing/lit_scene.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/base/check.hpp"

namespace lichthof {

LitScene::LitScene(std::shared_ptr<const Scene> scene)
    : trace_(std::make_shared<TraceScene>(scene)), direct_(std::make_shared<DirectLight>(trace_)),
      mean_indirect_(estimated_ambient(*scene)) {}

LitScene::LitScene(const Solution& solution) : LitScene(solution.scene) {
  const Mesh& mesh = *solution.mesh;
  MUST(solution.irradiance.size() == mesh.elements.size() &&
       solution.direct_irradiance.size() == mesh.elements.size() && solution.pending.size() == mesh.elements.size());
  geometry_ = std::make_shared<FieldGeometry>(*solution.scene, solution.mesh);
  element_size_ = mesh.options.element_size;

  std::vector<Rgb> total(mesh.elements.size()), indirect(mesh.elements.size());
  reflected_.resize(mesh.elements.size());
  Rgb sum{0.0}, reflected{0.0}, squares{0.0};
  double area = 0;
  for (const Patch& patch : mesh.patches)
    for (std::uint32_t e = patch.first_element; e < patch.first_element + patch.element_count; ++e) {
      total[e] = glm::max(solution.total(e), Rgb{0.0});
      indirect[e] = glm::max(solution.indirect(e), Rgb{0.0});
      reflected_[e] = Rgbf{patch.reflectance * total[e]};
      const Rgb power = static_cast<double>(mesh.elements[e].area) * patch.reflectance * total[e];
      reflected += power, squares += power * patch.reflectance * total[e];
      if (!mesh.group_is_lit[patch.group.value]) continue;
      sum += static_cast<double>(mesh.elements[e].area) * indirect[e];
      area += mesh.elements[e].area;
    }
  total_ = std::make_unique<IrradianceField>(geometry_, total);
  indirect_ = std::make_unique<IrradianceField>(geometry_, indirect);
  if (area > 0) mean_indirect_ = sum / area;
  for (int c = 0; c < 3; ++c) bright_radiosity_[c] = reflected[c] > 0 ? squares[c] / reflected[c] : 0.0;
  find_edges_of_spots(solution);
}

void LitScene::find_edges_of_spots(const Solution& solution) {
  constexpr double uneven = 0.5;         // of the brighter of two neighbours
  constexpr double bright_share = 0.25;  // what is dimmer matters less than noise
  const Mesh& mesh = *solution.mesh;
  std::vector<double> direct(mesh.elements.size());
  for (const Patch& patch : mesh.patches)
    for (std::uint32_t e = patch.first_element; e < patch.first_element + patch.element_count; ++e)
      direct[e] = sum_channels(patch.reflectance * Rgb{solution.direct_irradiance[e]});
  const double bright = sum_channels(bright_radiosity_);
  is_edge_of_spot_.assign(mesh.elements.size(), 0);
  for (std::uint32_t e = 0; e < mesh.elements.size(); ++e) {
    if (!(direct[e] > bright_share * bright)) continue;
    for (const std::uint32_t next : geometry_->touching(e))
      if (direct[next] < (1 - uneven) * direct[e]) is_edge_of_spot_[e] = is_edge_of_spot_[next] = 1;
  }
}

Rgb LitScene::total_irradiance(const SurfacePoint& at) const {
  return total_ ? total_->at(SurfaceId{at.surface}, at.back, at.point) : Rgb{0.0};
}

Rgb LitScene::indirect_irradiance(const SurfacePoint& at) const {
  return indirect_ ? indirect_->at(SurfaceId{at.surface}, at.back, at.point) : Rgb{0.0};
}

bool LitScene::is_edge_of_spot(const SurfacePoint& at) const {
  const auto element = geometry_->element_at(SurfaceId{at.surface}, at.back, at.point);
  return element && is_edge_of_spot_[*element] != 0;
}

bool LitScene::has_elements(const SurfacePoint& at) const {
  return geometry_ && geometry_->element_at(SurfaceId{at.surface}, at.back, at.point).has_value();
}

double LitScene::element_size(const SurfacePoint& at) const {
  if (!geometry_) return 0;
  const auto element = geometry_->element_at(SurfaceId{at.surface}, at.back, at.point);
  if (!element) return 0;
  const Vec2 size = geometry_->size_of(*element);
  return std::min(element_size_, std::sqrt(size.x * size.y));
}

Rgb LitScene::reflected_radiosity(const SurfacePoint& at, double distance) const {
  if (!geometry_) return Rgb{0.0};
  const SurfaceId surface{at.surface};
  if (distance < 2 * element_size_ || geometry_->near_contact(surface, at.back, at.point)) {
    const Scene& scene = trace_->scene();
    return reflectance_at(scene, scene.surfaces[at.surface], at.point) * total_->at(surface, at.back, at.point);
  }
  const auto element = geometry_->element_at(surface, at.back, at.point);
  return element ? Rgb{reflected_[*element]} : Rgb{0.0};
}

std::size_t LitScene::memory_bytes() const {
  std::size_t bytes = trace_->memory_bytes() + direct_->memory_bytes() + bytes_of_all(reflected_, is_edge_of_spot_);
  if (geometry_) bytes += geometry_->memory_bytes() + total_->memory_bytes() + indirect_->memory_bytes();
  return bytes;
}

Rgb estimated_ambient(const Scene& scene) {
  Rgb reflecting{0.0}, emitted{0.0};
  double area = 0;
  for (const Surface& surface : scene.surfaces) {
    const Material& material = scene.material_of(surface);
    if (material.finish == Finish::glass) continue;
    reflecting += surface.area * material.reflectance;
    emitted += std::numbers::pi * surface.area * material.radiance;
    area += surface.area;
  }
  if (!(area > 0)) return Rgb{0.0};
  const Rgb mean = glm::min(reflecting / area, Rgb{0.99});
  return mean * emitted / ((Rgb{1.0} - mean) * area);
}

}  // namespace lichthof
