#include "core/tracing/path_tracer.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/base/check.hpp"
#include "core/tracing/scattering.hpp"

namespace lichthof {

namespace {

/// Paths never end by length alone (that would be bias); this only guards against a scene that absorbs nothing.
constexpr int most_bounces = 100000;
/// Bounces before Russian roulette begins.
constexpr int certain_bounces = 3;
/// Density (1/sr) of a direction that a mirror or the eye chose: no shadow ray competes with it.
constexpr double certain = -1.0;

/// Sums of samples, for mean and standard error.
struct Sums {
  Rgb first{0.0}, second{0.0};
  void add(const Rgb& x) { first += x, second += x * x; }
  Estimate estimate(std::uint32_t count) const {
    const double n = count;
    const Rgb mean = first / n;
    Rgb error{0.0};
    if (count > 1) {
      const Rgb variance = glm::max(second / n - mean * mean, Rgb{0.0}) * (n / (n - 1.0));
      for (int c = 0; c < 3; ++c) error[c] = std::sqrt(variance[c] / n);
    }
    return {mean, error};
  }
};

}  // namespace

Rgb PathTracer::Scatterer::value(const Vec3& direction) const {
  const double lobe = std::max(0.0, glm::dot(direction, mirror));
  return diffuse * std::numbers::inv_pi +
         (max_channel(glossy) > 0 ? glossy * (exponent + 2.0) / (2.0 * std::numbers::pi) * std::pow(lobe, exponent)
                                  : Rgb{0.0});
}

double PathTracer::Scatterer::density(const Vec3& direction) const {
  const double cosine = std::max(0.0, glm::dot(direction, at.normal));
  const double lobe = diffuse_chance < 1 ? phong_density(glm::dot(direction, mirror), exponent) : 0.0;
  return diffuse_chance * cosine * std::numbers::inv_pi + (1 - diffuse_chance) * lobe;
}

Rgb PathTracer::lit_directly(const Scatterer& scatterer, Random& random, std::uint64_t& rays) const {
  const DirectLight& lights = scene_->direct();
  if (lights.luminaire_count() == 0) return Rgb{0.0};
  const TraceScene& trace = scene_->trace();
  const DirectLight::Sample sample = lights.sample(random);
  const Vec3 way = sample.point - scatterer.at.point;
  const double d2 = glm::dot(way, way);
  if (!(d2 > 0)) return Rgb{0.0};
  const Vec3 direction = way / std::sqrt(d2);
  const double here = glm::dot(direction, scatterer.at.normal), there = -glm::dot(direction, sample.normal);
  if (here <= 0 || there <= 0) return Rgb{0.0};
  const Vec3 from = trace.lifted(scatterer.at), to = sample.point + trace.offset() * sample.normal;
  ++rays;
  if (trace.clear_rays().occluded(from, to)) return Rgb{0.0};
  const double clear = trace.transmittance(from, to, true);
  if (clear <= 0) return Rgb{0.0};
  // Balance heuristic against hitting the same point by chance, both per solid angle.
  const double density = sample.density * d2 / there;
  return clear * here / (density + scatterer.density(direction)) * scatterer.value(direction) * sample.radiance;
}

Rgb PathTracer::traced(Vec3 from, Vec3 direction, Rgb throughput, double density, Random& random, std::uint64_t& rays,
                       const SurfacePoint* met) const {
  const TraceScene& trace = scene_->trace();
  Rgb sum{0.0};
  Vec3 scattered_at = from;  // where the density belongs to
  for (int bounce = 0; bounce < most_bounces; ++bounce) {
    const bool is_met = met && bounce == 0;
    if (!is_met) ++rays;
    const std::optional<SurfacePoint> at = is_met ? *met : trace.nearest(from, direction);
    if (!at) return sum;
    const Surface& surface = trace.scene().surfaces[at->surface];
    const Material& material = trace.scene().material_of(surface);
    const double cosine = -glm::dot(direction, at->normal);
    if (!at->back && material.emits() && !is_met) {
      double weight = 1.0;
      if (density != certain) {
        const Vec3 way = at->point - scattered_at;
        const double by_light = scene_->direct().density(at->surface) * glm::dot(way, way) / std::max(cosine, 1e-300);
        weight = density / (density + by_light);
      }
      sum += weight * throughput * material.radiance;
    }

    if (material.finish == Finish::glass) {
      const auto way = trace.way_at_glass(*at, direction, random.unit());
      if (!way) return sum;
      from = way->from, direction = way->direction;
      // A pane seen through is no scattering: shadow rays know that way.
      if (way->is_reflected || trace.is_solid_glass(at->surface)) density = certain;
      continue;
    }

    // Choose a lobe: cosine, Phong, or the mirror's single direction.
    const Rgb diffuse = reflectance_at(trace.scene(), surface, at->point), specular = specular_share(material, diffuse);
    const double diffuse_part = max_channel(diffuse), specular_part = max_channel(specular);
    if (diffuse_part + specular_part <= 0) return sum;
    const double diffuse_chance = diffuse_part / (diffuse_part + specular_part);
    const bool is_mirror = material.finish == Finish::mirror;
    const Scatterer scatterer{*at,
                              mirrored(direction, at->normal),
                              diffuse,
                              is_mirror ? Rgb{0.0} : specular,
                              material.exponent,
                              is_mirror ? 1.0 : diffuse_chance};
    // Shadow rays see the cosine lobe and the Phong lobe, never the mirror's one direction.
    if (diffuse_part > 0 || !is_mirror) sum += throughput * lit_directly(scatterer, random, rays);
    const bool take_specular = random.unit() >= diffuse_chance;
    const Vec2 square{random.unit(), random.unit()};
    if (is_mirror && take_specular) {
      direction = scatterer.mirror;
      throughput *= specular / (1 - diffuse_chance);
      density = certain;
    } else {
      if (take_specular) {
        direction = phong_direction(scatterer.mirror, material.exponent, square);
      } else {
        Vec3 tangent, bitangent;
        complete_frame(at->normal, tangent, bitangent);
        const Vec3 local = cosine_direction(square);
        direction = local.x * tangent + local.y * bitangent + local.z * at->normal;
      }
      const double leaving = glm::dot(direction, at->normal);
      density = scatterer.density(direction);
      if (leaving <= 0 || !(density > 0)) return sum;
      throughput *= scatterer.value(direction) * leaving / density;
      if (is_mirror) throughput /= diffuse_chance;
    }
    from = trace.lifted(*at);
    scattered_at = at->point;
    if (bounce >= certain_bounces) {
      const double go_on = std::min(0.98, max_channel(throughput));
      if (random.unit() >= go_on) return sum;
      throughput /= go_on;
    }
  }
  return sum;
}

Rgb PathTracer::radiance(const Vec3& from, const Vec3& direction, Random& random, std::uint64_t& rays) const {
  return traced(from, direction, Rgb{1.0}, certain, random, rays);
}

Rgb PathTracer::reflected(const SurfacePoint& at, const Vec3& direction, Random& random, std::uint64_t& rays) const {
  return traced(at.point, direction, Rgb{1.0}, certain, random, rays, &at);
}

Estimate PathTracer::pixel(const PinholeCamera& camera, std::uint32_t column, std::uint32_t row, std::uint32_t samples,
                           std::uint64_t& rays) const {
  const std::uint64_t seed = mix64((std::uint64_t{column} << 32) | row);
  Sums sums;
  for (std::uint32_t s = 0; s < samples; ++s) {
    Random random(seed, s);
    const double x = random.unit(), y = random.unit();
    sums.add(radiance(camera.eye(), camera.direction(Vec2{column, row} + Vec2{x, y}), random, rays));
  }
  return sums.estimate(samples);
}

Estimate PathTracer::irradiance(const SensorPoint& sensor, std::uint32_t samples, std::uint64_t seed,
                                std::uint64_t& rays) const {
  const double length = glm::length(sensor.normal);
  if (!(length > 0)) return {};
  const TraceScene& trace = scene_->trace();
  const Vec3 normal = sensor.normal / length;
  const auto on = trace.surface_below(sensor.point, normal, std::max(1e-5 * trace.size(), 4 * trace.offset()));
  // The sensor scatters like a white wall: irradiance is π times the radiance that leaves it.
  Scatterer scatterer{on.value_or(SurfacePoint{0, false, sensor.point, normal}), Vec3{0.0}, Rgb{1.0}, Rgb{0.0}, 0, 1};
  scatterer.at.normal = normal;
  Vec3 tangent, bitangent;
  complete_frame(normal, tangent, bitangent);
  Sums sums;
  for (std::uint32_t s = 0; s < samples; ++s) {
    Random random(mix64(seed), s);
    const Rgb direct = lit_directly(scatterer, random, rays);
    const double x = random.unit(), y = random.unit();
    const Vec3 local = cosine_direction({x, y});
    const Vec3 direction = local.x * tangent + local.y * bitangent + local.z * normal;
    const Rgb rest =
        traced(trace.lifted(scatterer.at), direction, Rgb{1.0}, local.z * std::numbers::inv_pi, random, rays);
    sums.add(std::numbers::pi * (direct + rest));
  }
  return sums.estimate(samples);
}

std::vector<Estimate> reference_irradiance(const PathTracer& tracer, std::span<const SensorPoint> points,
                                           std::uint32_t samples, const Parallel& parallel, std::uint64_t& rays) {
  std::vector<Estimate> estimates(points.size());
  std::vector<std::uint64_t> rays_of_point(points.size(), 0);
  parallel.for_each(points.size(),
                    [&](std::size_t i) { estimates[i] = tracer.irradiance(points[i], samples, i, rays_of_point[i]); });
  for (const std::uint64_t count : rays_of_point) rays += count;
  return estimates;
}

std::vector<Estimate> ReferenceTracer::estimates(const ColumnJob& job, std::uint64_t& rays) const {
  MUST(job.first <= job.last && job.last <= camera_.width());
  const std::uint32_t height = camera_.height();
  std::vector<Estimate> pixels(std::size_t{job.size()} * height);
  std::vector<std::uint64_t> rays_of_pixel(pixels.size(), 0);
  parallel_->for_each(pixels.size(), [&](std::size_t i) {
    if (stop_ && *stop_) return;
    pixels[i] = tracer_.pixel(camera_, job.first + static_cast<std::uint32_t>(i / height),
                              static_cast<std::uint32_t>(i % height), samples_, rays_of_pixel[i]);
  });
  for (const std::uint64_t count : rays_of_pixel) rays += count;
  return pixels;
}

std::size_t ReferenceTracer::memory_bytes() const { return tracer_.scene().memory_bytes(); }

std::vector<Rgbf> ReferenceTracer::columns(const ColumnJob& job, std::uint64_t& rays) const {
  std::vector<Rgbf> pixels;
  pixels.reserve(std::size_t{job.size()} * camera_.height());
  for (const Estimate& estimate : estimates(job, rays)) pixels.push_back(Rgbf{estimate.mean});
  return pixels;
}

}  // namespace lichthof
