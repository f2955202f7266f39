#include "core/light/lost_light.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include "core/base/random.hpp"

namespace lichthof {

namespace {

/// Nearer than this many sizes of a luminaire (√area) is at it.
constexpr double touching = 0.01;

class LostLightSearch {
 public:
  LostLightSearch(const Scene& scene, const RayScene& rays) : scene_(scene), rays_(rays) {
    for (const Surface& surface : scene.surfaces) up_to_.push_back((up_to_.empty() ? 0 : up_to_.back()) + surface.area);
  }

  std::optional<LostLight::Where> where_lost(std::uint32_t luminaire) const {
    using enum LostLight::Where;
    const Surface& surface = scene_.surfaces[luminaire];
    constexpr int count = 64, nearly_all = 62;
    int left = 0, at_once = 0;
    Vec3 tangent, bitangent;
    complete_frame(surface.normal, tangent, bitangent);
    Random random(luminaire, 4);
    for (int k = 0; k < count; ++k) {
      const Vec3 local = cosine_direction(r2_point(static_cast<std::uint32_t>(k), {0.5, 0.5}));
      const Vec3 from = point_of(surface, {random.unit(), random.unit()}) + rays_.offset() * surface.normal;
      const std::optional<Hit> hit =
          rays_.nearest(from, local.x * tangent + local.y * bitangent + local.z * surface.normal);
      if (!hit)
        ++left;
      else if (hit->distance < touching * std::sqrt(surface.area))
        ++at_once;
      if (k + 1 - left - at_once > count - nearly_all) return std::nullopt;
    }
    if (at_once >= nearly_all) return into_support;
    if (left < count || is_seen(luminaire, random)) return std::nullopt;
    return lies_in_face(surface) ? into_support : out_of_scene;
  }

 private:
  /// Whether any of some places of the scene, half of them chosen by area and half by surface, sees the luminaire's front.
  bool is_seen(std::uint32_t luminaire, Random& random) const {
    constexpr int places = 256;
    const Surface& surface = scene_.surfaces[luminaire];
    for (int k = 0; k < places; ++k) {
      const double unit = random.unit();
      const auto by_area = std::lower_bound(up_to_.begin(), up_to_.end(), unit * up_to_.back()) - up_to_.begin();
      const auto count = static_cast<double>(scene_.surfaces.size());
      const auto other = k % 2 ? static_cast<std::size_t>(by_area) : static_cast<std::size_t>(unit * count);
      if (other == luminaire || other >= scene_.surfaces.size()) continue;
      const Vec3 to = point_of(surface, {random.unit(), random.unit()}) + rays_.offset() * surface.normal;
      const Vec3 place = point_of(scene_.surfaces[other], {random.unit(), random.unit()});
      const Vec3& normal = scene_.surfaces[other].normal;
      const Vec3 from = place + (glm::dot(to - place, normal) > 0 ? 1.0 : -1.0) * rays_.offset() * normal;
      if (glm::dot(from - to, surface.normal) > rays_.offset() && !rays_.occluded(from, to)) return true;
    }
    return false;
  }

  /// Whether beside most of its edges something lies in its plane.
  bool lies_in_face(const Surface& surface) const {
    const double step = touching * std::sqrt(surface.area);
    std::size_t beside = 0;
    for (std::size_t k = 0; k < surface.corners.size(); ++k) {
      const Vec3 &a = surface.corners[k], &b = surface.corners[(k + 1) % surface.corners.size()];
      const Vec3 out = glm::normalize(glm::cross(b - a, surface.normal));
      const Vec3 from = 0.5 * (a + b) + step * (out + surface.normal);
      const std::optional<Hit> hit = rays_.nearest(from, -surface.normal, 1.5 * step);
      if (hit && hit->distance > 0.5 * step && !scene_.material_of(scene_.surfaces[hit->surface]).emits()) ++beside;
    }
    return 2 * beside > surface.corners.size();
  }

  const Scene& scene_;
  const RayScene& rays_;
  std::vector<double> up_to_;  ///< area
};

}  // namespace

std::vector<LostLight> lost_light(const Scene& scene, const RayScene& rays, const Parallel& parallel) {
  std::vector<std::uint32_t> luminaires;
  for (std::uint32_t s = 0; s < scene.surfaces.size(); ++s)
    if (scene.material_of(scene.surfaces[s]).emits() && scene.surfaces[s].area > 0) luminaires.push_back(s);
  std::vector<std::optional<LostLight::Where>> found(luminaires.size());
  const LostLightSearch search(scene, rays);
  parallel.for_each(luminaires.size(), [&](std::size_t i) { found[i] = search.where_lost(luminaires[i]); });
  std::vector<LostLight> lost;
  for (std::size_t i = 0; i < luminaires.size(); ++i)
    if (found[i]) lost.push_back({luminaires[i], *found[i]});
  return lost;
}

}  // namespace lichthof
