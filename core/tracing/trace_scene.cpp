#include "core/tracing/trace_scene.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numeric>

#include "core/base/check.hpp"
#include "core/base/footprint.hpp"
#include "core/tracing/scattering.hpp"

namespace lichthof {

TraceScene::TraceScene(std::shared_ptr<const Scene> scene)
    : scene_(std::move(scene)), size_(glm::length(bounds(*scene_).size())),
      rays_(*scene_, scene_->surfaces, bounds(*scene_).centre()) {
  MUST(!scene_->surfaces.empty());
  std::vector<Surface> panes;
  for (std::uint32_t s = 0; s < scene_->surfaces.size(); ++s) {
    if (scene_->material_of(scene_->surfaces[s]).finish != Finish::glass) continue;
    panes.push_back(scene_->surfaces[s]);
    glass_surfaces_.push_back(s);
  }
  if (panes.empty()) return;
  clear_ = std::make_unique<RayScene>(*scene_, scene_->surfaces, bounds(*scene_).centre(), Glass::clear);
  glass_only_ = std::make_unique<RayScene>(*scene_, panes, bounds(*scene_).centre());
  find_solids();
}

void TraceScene::find_solids() {
  // Corners equal within 1e-6 of the scene are one; an edge is an unordered pair of them.
  const double step = std::max(1e-6 * size_, 1e-300);
  const auto key = [&](const Vec3& p) {
    return std::array<std::int64_t, 3>{std::llround(p.x / step), std::llround(p.y / step), std::llround(p.z / step)};
  };
  using Edge = std::pair<std::array<std::int64_t, 3>, std::array<std::int64_t, 3>>;
  std::map<Edge, std::vector<std::uint32_t>> faces_of_edge;
  for (const std::uint32_t s : glass_surfaces_) {
    const Polygon& corners = scene_->surfaces[s].corners;
    for (std::size_t k = 0; k < corners.size(); ++k) {
      auto a = key(corners[k]), b = key(corners[(k + 1) % corners.size()]);
      if (b < a) std::swap(a, b);
      faces_of_edge[{a, b}].push_back(s);
    }
  }
  // Join faces along shared edges; one open edge makes the whole body a set of panes.
  std::vector<std::uint32_t> body(scene_->surfaces.size());
  std::iota(body.begin(), body.end(), 0u);
  const auto find = [&](std::uint32_t s) {
    while (body[s] != s) s = body[s] = body[body[s]];
    return s;
  };
  for (const auto& [edge, faces] : faces_of_edge)
    for (const std::uint32_t s : faces) body[find(s)] = find(faces.front());
  std::vector<std::uint8_t> open(scene_->surfaces.size(), 0);
  for (const auto& [edge, faces] : faces_of_edge)
    if (faces.size() != 2) open[find(faces.front())] = 1;
  solid_.assign(scene_->surfaces.size(), 0);
  for (const std::uint32_t s : glass_surfaces_) {
    solid_[s] = !open[find(s)];
    has_solids_ = has_solids_ || solid_[s] != 0;
  }
}

double TraceScene::refractive_index(const SurfacePoint& at) const {
  const double index = scene_->material_of(scene_->surfaces[at.surface]).refractive_index;
  return is_solid_glass(at.surface) && at.back ? 1.0 / index : index;
}

double TraceScene::glass_reflectance(const SurfacePoint& at, const Vec3& direction) const {
  const double cosine = -glm::dot(direction, at.normal), eta = refractive_index(at);
  return is_solid_glass(at.surface) ? fresnel_reflectance(cosine, eta) : pane_reflectance(cosine, eta);
}

std::optional<GlassWay> TraceScene::way_at_glass(const SurfacePoint& at, const Vec3& direction, double choice) const {
  if (choice < glass_reflectance(at, direction)) return GlassWay{lifted(at), mirrored(direction, at.normal), true};
  GlassWay way{at.point - offset() * at.normal, direction, false};
  if (is_solid_glass(at.surface) && !refracted(direction, at.normal, refractive_index(at), way.direction))
    return std::nullopt;
  return way;
}

Rgb TraceScene::luminaire_in_glass(const SurfacePoint& at, const Vec3& direction, std::uint64_t& rays) const {
  ++rays;
  const std::optional<SurfacePoint> shown = nearest(lifted(at), mirrored(direction, at.normal));
  if (!shown || shown->back) return Rgb{0.0};
  return glass_reflectance(at, direction) * scene_->material_of(scene_->surfaces[shown->surface]).radiance;
}

SurfacePoint TraceScene::surface_point(std::uint32_t surface, bool front, const Vec3& near_point) const {
  const Surface& met = scene_->surfaces[surface];
  return {surface, !front, near_point - glm::dot(near_point - met.corners[0], met.normal) * met.normal,
          front ? met.normal : -met.normal};
}

std::optional<SurfacePoint> TraceScene::nearest(const Vec3& from, const Vec3& direction) const {
  const std::optional<Hit> hit = rays_.nearest(from, direction);
  if (!hit) return std::nullopt;
  return surface_point(hit->surface, hit->front, from + hit->distance * direction);
}

std::optional<SurfacePoint> TraceScene::surface_below(const Vec3& point, const Vec3& normal, double tolerance) const {
  const std::optional<Hit> hit = rays_.nearest(point + tolerance * normal, -normal, 2 * tolerance);
  if (!hit) return std::nullopt;
  const SurfacePoint at = surface_point(hit->surface, hit->front, point);
  if (glm::dot(at.normal, normal) < 0.999) return std::nullopt;
  return at;
}

double TraceScene::transmittance(const Vec3& from, const Vec3& to, bool solids_block) const {
  if (!has_glass()) return 1.0;
  const Vec3 direction = to - from;
  const double length = glm::length(direction);
  double share = 1.0, travelled = 0.0;
  // Walk from pane to pane; the bound only guards against a pathological pile of them.
  for (int crossing = 0; crossing < 64; ++crossing) {
    const Vec3 start = from + travelled * direction;
    const std::optional<Hit> hit = glass_only_->nearest(start, direction, 1.0 - travelled);
    if (!hit) return share;
    const std::uint32_t s = glass_surfaces_[hit->surface];
    if (solids_block && solid_[s]) return 0.0;
    const Surface& surface = scene_->surfaces[s];
    const double cosine = std::abs(glm::dot(direction, surface.normal)) / length;
    const double n = scene_->material_of(surface).refractive_index;
    share *= 1.0 - (solid_[s] ? fresnel_reflectance(cosine, n) : pane_reflectance(cosine, n));
    travelled += hit->distance + 2 * offset() / std::max(cosine, 1e-3) / length;
    if (travelled >= 1.0) return share;
  }
  return 0.0;
}

std::size_t TraceScene::memory_bytes() const {
  std::size_t bytes = bytes_of_all(glass_surfaces_, solid_);
  for (const RayScene* rays : std::initializer_list<const RayScene*>{&rays_, clear_.get(), glass_only_.get()})
    if (rays) bytes += rays->memory_bytes();
  return bytes;
}

}  // namespace lichthof
