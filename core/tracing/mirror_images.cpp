#include "core/tracing/mirror_images.hpp"

#include <algorithm>
#include <numbers>

#include "core/base/footprint.hpp"
#include "core/light/form_factor.hpp"
#include "core/scene/polygon.hpp"
#include "core/tracing/scattering.hpp"
#include "core/tracing/shining_place.hpp"

namespace lichthof {

namespace {

/// More pairs of mirror sides and luminaires than this would cost more than they give.
constexpr std::size_t most_images = 2048;

Vec3 reflected_point(const Vec3& point, const Vec3& on_plane, const Vec3& normal) {
  return point - 2.0 * glm::dot(point - on_plane, normal) * normal;
}

}  // namespace

MirrorImages::MirrorImages(std::shared_ptr<const TraceScene> scene) : scene_(std::move(scene)) {
  const Scene& input = scene_->scene();
  std::vector<std::uint32_t> mirrors, luminaires;
  for (std::uint32_t s = 0; s < input.surfaces.size(); ++s) {
    const Material& material = input.material_of(input.surfaces[s]);
    if (is_mirror(material)) mirrors.push_back(s);
    if (material.emits()) luminaires.push_back(s);
  }
  if (2 * mirrors.size() * luminaires.size() > most_images) return;
  for (const std::uint32_t mirror : mirrors)
    for (const double side : {1.0, -1.0})
      for (const std::uint32_t luminaire : luminaires)
        if (mirror != luminaire) add(mirror, side * input.surfaces[mirror].normal, luminaire);
}

void MirrorImages::add(std::uint32_t mirror, const Vec3& mirror_normal, std::uint32_t luminaire) {
  const Scene& input = scene_->scene();
  const Surface &shows = input.surfaces[mirror], &shines = input.surfaces[luminaire];
  const Vec3 on_mirror = shows.corners[0];
  const double lift = scene_->offset();
  // What lies before the mirror; a lamp in its plane is not shown.
  const Polygon before =
      clipped(std::span<const Vec3>(shines.corners), mirror_normal, glm::dot(mirror_normal, on_mirror) + 4 * lift, 0.0);
  if (before.size() < 3) return;
  Image image{mirror, luminaire, mirror_normal, {}, mirrored(shines.normal, mirror_normal)};
  for (const Vec3& corner : before) image.corners.push_back(reflected_point(corner, on_mirror, mirror_normal));
  std::reverse(image.corners.begin(), image.corners.end());  // a reflection turns the order round
  // Somebody before the mirror must stand before the image, too.
  const bool is_seen = std::any_of(shows.corners.begin(), shows.corners.end(), [&](const Vec3& corner) {
    return glm::dot(corner - image.corners[0], image.normal) > 0;
  });
  if (is_seen || glm::dot(image.normal, mirror_normal) > 0) images_.push_back(std::move(image));
}

/// The part of the image that the point sees through the mirror's outline.
Polygon MirrorImages::within_outline(const Image& image, const Vec3& point) const {
  const Polygon& outline = scene_->scene().surfaces[image.mirror].corners;
  const Vec3 middle = centroid(std::span<const Vec3>(outline));
  Polygon left = image.corners;
  for (std::size_t k = 0; k < outline.size() && left.size() >= 3; ++k) {
    Vec3 inwards = glm::cross(outline[k] - point, outline[(k + 1) % outline.size()] - point);
    const double length = glm::length(inwards);
    if (!(length > 0)) continue;
    inwards /= glm::dot(inwards, middle - point) < 0 ? -length : length;
    left = clipped(std::span<const Vec3>(left), inwards, glm::dot(inwards, point), 0.0);
  }
  return left;
}

Rgb MirrorImages::irradiance(const Vec3& point, const Vec3& normal, std::uint32_t rays_per_image, std::uint64_t seed,
                             std::uint64_t& rays) const {
  const Scene& input = scene_->scene();
  const double lift = scene_->offset();
  const Vec3 start = point + lift * normal;
  const RayScene& trace = scene_->clear_rays();
  Random random(seed, 23);
  Rgb sum{0.0};
  for (const Image& image : images_) {
    const Surface& mirror = input.surfaces[image.mirror];
    const double before = glm::dot(image.mirror_normal, point - mirror.corners[0]);
    if (before <= 2 * lift || glm::dot(image.normal, point - image.corners[0]) <= 0) continue;
    const bool rises = std::any_of(mirror.corners.begin(), mirror.corners.end(),
                                   [&](const Vec3& corner) { return glm::dot(normal, corner - point) > 0; });
    if (!rises) continue;
    const Polygon shown = within_outline(image, point);
    if (shown.size() < 3) continue;
    const double factor = form_factor(point, normal, shown);
    if (!(factor > 0)) continue;
    const Material& finish = input.material_of(mirror);
    const Surface& luminaire = input.surfaces[image.luminaire];
    const Vec3 middle = centroid(std::span<const Vec3>(shown));
    const double shown_area = area(std::span<const Vec3>(shown));
    Rgb arriving{0.0};
    for (std::uint32_t ray = 0; ray < rays_per_image; ++ray) {
      const Vec3 aim = shining_place(shown, shown_area, image.normal, point, normal, middle, random);
      const double beyond = -glm::dot(image.mirror_normal, aim - mirror.corners[0]);
      const Vec3 turn = point + before / (before + beyond) * (aim - point);  // where the way meets the mirror
      const Vec3 from_mirror = turn + lift * image.mirror_normal;
      const Vec3 lamp = reflected_point(aim, mirror.corners[0], image.mirror_normal) + lift * luminaire.normal;
      ++rays;
      if (trace.occluded(start, from_mirror)) continue;
      ++rays;
      if (trace.occluded(from_mirror, lamp)) continue;
      arriving += specular_share(finish, reflectance_at(input, mirror, turn)) *
                  (scene_->transmittance(start, from_mirror) * scene_->transmittance(from_mirror, lamp));
    }
    sum += std::numbers::pi * factor / rays_per_image * arriving * input.material_of(luminaire).radiance;
  }
  return sum;
}

std::size_t MirrorImages::memory_bytes() const {
  std::size_t bytes = bytes_of_all(images_);
  for (const Image& image : images_) bytes += bytes_of_all(image.corners);
  return bytes;
}

}  // namespace lichthof
