#include "core/tracing/diffuse_landing.hpp"

#include <numbers>

#include "core/tracing/scattering.hpp"

namespace lichthof {

namespace {
constexpr int most_bounces = 12;           // between mirrors and panes
constexpr double least_throughput = 1e-3;  // what carries less is not followed
}  // namespace

bool scatters_on(const TraceScene& trace, std::uint32_t surface) {
  const Material& material = trace.scene().material_of(trace.scene().surfaces[surface]);
  return material.finish == Finish::glass || is_specular(material);
}

Rgb follow(const LitScene& scene, DiffuseLanding& landing, Vec3 direction, Random& random, std::uint64_t& rays) {
  const TraceScene& trace = scene.trace();
  const Scene& input = trace.scene();
  Rgb seen{0.0};
  bool emission_counts = false, is_counted = false, knows_mirror = scene.direct().has_mirror_images();
  for (int bounce = 0; bounce < most_bounces; ++bounce) {
    const SurfacePoint at = landing.at;
    const Surface& surface = input.surfaces[at.surface];
    const Material& material = input.material_of(surface);
    if (emission_counts && !is_counted && !at.back) seen += landing.weight * std::numbers::pi * material.radiance;
    is_counted = false;
    Vec3 from = trace.lifted(at);
    if (material.finish == Finish::glass) {
      seen += landing.weight * std::numbers::pi * trace.luminaire_in_glass(at, direction, rays);
      const auto way = trace.way_at_glass(at, direction, random.unit());
      if (!way) break;
      from = way->from, direction = way->direction;
      is_counted = way->is_reflected;
      if (way->is_reflected) emission_counts = true, knows_mirror = false;
    } else {
      const Rgb diffuse = reflectance_at(input, surface, at.point), share = specular_share(material, diffuse);
      const double both = max_channel(share) + max_channel(diffuse);
      const double as_mirror = both > 0 ? max_channel(share) / both : 0.0;
      if (!(random.unit() < as_mirror)) {
        landing.weight /= 1 - as_mirror;
        return seen;
      }
      landing.weight *= share / as_mirror;
      const Vec3 mirror = mirrored(direction, at.normal);
      direction = mirror;
      if (material.finish == Finish::glossy) {
        direction = phong_direction(mirror, material.exponent, {random.unit(), random.unit()});
        const double towards = glm::dot(direction, at.normal);
        if (towards <= 0) break;
        landing.weight *= phong_weight(towards, material.exponent);
        knows_mirror = false;
      }
      emission_counts = !knows_mirror;
      knows_mirror = false;
    }
    if (max_channel(landing.weight) < least_throughput) break;
    const auto next = trace.nearest(from, direction);
    ++rays;
    if (!next) break;
    landing.at = *next;
  }
  landing.met = false;
  return seen;
}

}  // namespace lichthof
