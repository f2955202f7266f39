#include "core/tracing/column_tracer.hpp"

#include <algorithm>
#include <numbers>

#include "core/base/check.hpp"
#include "core/base/random.hpp"
#include "core/tracing/scattering.hpp"

namespace lichthof {

Vec2 place_in_pixel(std::uint32_t index, std::uint32_t count, std::uint64_t pixel_seed) {
  if (count == 1) return {0.5, 0.5};
  Random random(pixel_seed, 3);
  const double x = random.unit(), y = random.unit();
  return r2_point(index, {x, y});
}

ColumnTracer::ColumnTracer(std::shared_ptr<const LitScene> scene, const PinholeCamera& camera,
                           const TracingOptions& options, std::shared_ptr<const Parallel> parallel)
    : scene_(std::move(scene)), camera_(camera), options_(options), parallel_(std::move(parallel)),
      ambient_(options.ambient.value_or(scene_->mean_indirect())) {
  MUST(options.samples >= 1 && options.lobe_rays >= 1);
  MUST(options.method == TracingMethod::raytrace || scene_->has_solution());
  if (options.method == TracingMethod::two_pass && options.gather_rays > 0)
    gather_.emplace(scene_, options.gather_rays);
  // About 64 shadow rays per pixel and luminaire, however many samples share them.
  direct_rays_ = options.samples == 1 ? 64 : options.samples <= 6 ? 16 : 4;
}

std::size_t ColumnTracer::memory_bytes() const { return scene_->memory_bytes(); }

std::vector<Rgbf> ColumnTracer::columns(const ColumnJob& job, std::uint64_t& rays) const {
  MUST(job.first <= job.last && job.last <= camera_.width());
  const std::uint32_t height = camera_.height();
  std::vector<Rgbf> pixels(std::size_t{job.size()} * height);
  // Pieces of columns, so that a job of one column keeps all threads busy.
  constexpr std::uint32_t piece = 16;
  const std::uint32_t pieces = (height + piece - 1) / piece;
  std::vector<std::uint64_t> rays_of_piece(std::size_t{job.size()} * pieces, 0);
  parallel_->for_each(rays_of_piece.size(), [&](std::size_t task) {
    const auto column = static_cast<std::uint32_t>(task / pieces);
    const auto first = static_cast<std::uint32_t>(task % pieces) * piece;
    for (std::uint32_t row = first; row < std::min(first + piece, height); ++row) {
      if (options_.stop && *options_.stop) return;
      pixels[std::size_t{column} * height + row] = Rgbf{pixel(job.first + column, row, rays_of_piece[task])};
    }
  });
  for (const std::uint64_t count : rays_of_piece) rays += count;
  return pixels;
}

Rgb ColumnTracer::pixel(std::uint32_t column, std::uint32_t row, std::uint64_t& rays) const {
  const std::uint64_t pixel_seed = mix64((std::uint64_t{column} << 32) | row);
  Rgb sum{0.0};
  for (std::uint32_t s = 0; s < options_.samples; ++s) {
    const Vec2 film = Vec2{column, row} + place_in_pixel(s, options_.samples, pixel_seed);
    sum += radiance({camera_.eye(), camera_.direction(film), 1.0, 0, mix64(pixel_seed + s + 1), false}, rays);
  }
  return sum / static_cast<double>(options_.samples);
}

Rgb ColumnTracer::radiance(const Path& path, std::uint64_t& rays) const {
  ++rays;
  const TraceScene& trace = scene_->trace();
  const auto at = trace.nearest(path.from, path.direction);
  if (!at) return Rgb{0.0};
  const Surface& surface = trace.scene().surfaces[at->surface];
  const Material& material = trace.scene().material_of(surface);
  Rgb sum = at->back ? Rgb{0.0} : material.radiance;
  if (material.finish == Finish::glass) return sum + through_glass(*at, path, material, rays);

  const Rgb reflectance = reflectance_at(trace.scene(), surface, at->point);
  if (max_channel(reflectance) > 0) sum += reflectance * std::numbers::inv_pi * diffuse_irradiance(*at, path, rays);

  const Rgb share = specular_share(material, reflectance);
  if (max_channel(share) <= 0) return sum;
  if (material.finish == Finish::glossy) return sum + through_lobe(*at, path, material, share, rays);
  const double throughput = path.throughput * max_channel(share);
  if (path.depth >= options_.depth || throughput < options_.throughput_cut) return sum;
  return sum + share * radiance({trace.lifted(*at), mirrored(path.direction, at->normal), throughput, path.depth + 1,
                                 mix64(path.seed), path.through_lobe},
                                rays);
}

Rgb ColumnTracer::diffuse_irradiance(const SurfacePoint& at, const Path& path, std::uint64_t& rays) const {
  if (options_.method == TracingMethod::radiosity) return scene_->total_irradiance(at);
  // Fewer rays for what is only seen blurred.
  const std::uint32_t most = path.through_lobe ? 4 : direct_rays_;
  DirectOptions direct{4 * most, most, {}};
  if (most < 64) direct.seed = path.seed;
  const Rgb sampled = scene_->direct().irradiance(at.point, at.normal, direct, rays);
  if (options_.method == TracingMethod::raytrace) return sampled + ambient_;
  if (gather_ && !path.through_lobe) return sampled + gather_->irradiance(at.point, at.normal, path.seed, rays);
  return sampled + scene_->indirect_irradiance(at);
}

Rgb ColumnTracer::through_glass(const SurfacePoint& at, const Path& path, const Material& material,
                                std::uint64_t& rays) const {
  if (path.depth >= options_.depth) return Rgb{0.0};
  const TraceScene& trace = scene_->trace();
  const bool solid = trace.is_solid_glass(at.surface);
  const double cosine = -glm::dot(path.direction, at.normal);
  const double eta = solid && at.back ? 1.0 / material.refractive_index : material.refractive_index;
  const double reflectance = solid ? fresnel_reflectance(cosine, eta) : pane_reflectance(cosine, eta);
  Rgb sum{0.0};
  if (const double throughput = path.throughput * reflectance; throughput >= options_.throughput_cut)
    sum += reflectance * radiance({trace.lifted(at), mirrored(path.direction, at.normal), throughput, path.depth + 1,
                                   mix64(path.seed + 1), path.through_lobe},
                                  rays);
  Vec3 onwards = path.direction;
  if (const double throughput = path.throughput * (1 - reflectance); throughput >= options_.throughput_cut) {
    if (solid && !refracted(path.direction, at.normal, eta, onwards)) return sum;
    sum += (1 - reflectance) * radiance({at.point - trace.offset() * at.normal, onwards, throughput, path.depth + 1,
                                         mix64(path.seed + 2), path.through_lobe},
                                        rays);
  }
  return sum;
}

Rgb ColumnTracer::through_lobe(const SurfacePoint& at, const Path& path, const Material& material, const Rgb& share,
                               std::uint64_t& rays) const {
  const double throughput = path.throughput * max_channel(share);
  if (path.depth >= options_.depth || throughput < options_.throughput_cut) return Rgb{0.0};
  // Several rays where the lobe is met first, one in reflections of reflections.
  const std::uint32_t count = path.through_lobe ? 1 : options_.lobe_rays;
  const Vec3 axis = mirrored(path.direction, at.normal);
  Random random(path.seed, 5);
  const double x = random.unit(), y = random.unit();
  Rgb sum{0.0};
  for (std::uint32_t i = 0; i < count; ++i) {
    const Vec3 direction = phong_direction(axis, material.exponent, r2_point(i, {x, y}));
    const double cosine = glm::dot(direction, at.normal);
    if (cosine <= 0) continue;
    sum += phong_weight(cosine, material.exponent) *
           radiance({scene_->trace().lifted(at), direction, throughput, path.depth + 1, mix64(path.seed + 3 + i), true},
                    rays);
  }
  return share * sum / static_cast<double>(count);
}

}  // namespace lichthof
