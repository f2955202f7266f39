#include "core/tracing/final_gather.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/base/check.hpp"
#include "core/base/random.hpp"
#include "core/tracing/scattering.hpp"

namespace lichthof {

namespace {

constexpr int table_count = 16;
/// A ray is given up after this many mirrors and panes, or takes what the element says after so many near hits.
constexpr int most_bounces = 12;
/// A ray that carries less than this share is not followed any further.
constexpr double least_throughput = 1e-3;
/// A hit is near below this distance, in sizes of an element. Measured in the furnished office (22k elements, 256 rays): relative
/// error 3.4, 2.1, 2.0, 1.9 % and 138, 251, 270, 411 µs a point for 0, 0.5, 1 and 2.
constexpr double near_hit = 0.5;

/// Bits of two 8-bit coordinates interleaved: neighbours on this curve are neighbours in the square.
std::uint32_t curve_place(const Vec2& square) {
  const auto x = static_cast<std::uint32_t>(square.x * 256), y = static_cast<std::uint32_t>(square.y * 256);
  std::uint32_t place = 0;
  for (int bit = 0; bit < 8; ++bit) place |= ((x >> bit) & 1) << (2 * bit) | ((y >> bit) & 1) << (2 * bit + 1);
  return place;
}

}  // namespace

FinalGather::FinalGather(std::shared_ptr<const LitScene> scene, std::uint32_t rays) : scene_(std::move(scene)) {
  MUST(scene_->has_solution());
  const std::uint32_t count = std::max(1u, (rays + 15) / 16) * 16;
  for (int t = 0; t < table_count; ++t) {
    Random random(static_cast<std::uint64_t>(t), 11);
    const Vec2 shift{random.unit(), random.unit()};
    std::vector<Vec2> squares;
    for (std::uint32_t i = 0; i < count; ++i) squares.push_back(r2_point(i, shift));
    std::sort(squares.begin(), squares.end(),
              [](const Vec2& a, const Vec2& b) { return curve_place(a) < curve_place(b); });
    std::vector<Vec3>& table = tables_.emplace_back();
    for (const Vec2& square : squares) {
      // Exactly horizontal rays would run inside their own surface.
      Vec3 direction = cosine_direction(square);
      direction.z = std::max(direction.z, 1e-4);
      table.push_back(direction);
    }
  }
  near_ = near_hit * scene_->element_size();
  const Scene& input = scene_->trace().scene();
  for (const Surface& surface : input.surfaces) {
    const Material& material = input.material_of(surface);
    scatters_.push_back(material.finish == Finish::glass || is_specular(material));
  }
}

Rgb FinalGather::irradiance(const Vec3& point, const Vec3& normal, std::uint64_t seed, std::uint64_t& rays) const {
  const TraceScene& trace = scene_->trace();
  const std::uint64_t mixed = mix64(seed);
  const std::vector<Vec3>& table = tables_[mixed % table_count];
  const double turn = 2.0 * std::numbers::pi * static_cast<double>(mixed >> 40) * 0x1p-24;
  Vec3 tangent, bitangent;
  complete_frame(normal, tangent, bitangent);
  const Vec3 across = std::cos(turn) * tangent + std::sin(turn) * bitangent;
  const Vec3 along = glm::cross(normal, across);

  const Vec3 start = point + trace.offset() * normal;
  const Vec3 local = start - trace.rays().origin();
  Segments16 segments;
  clear_segments(segments);
  for (int lane = 0; lane < 16; ++lane) {
    segments.ox[lane] = static_cast<float>(local.x);
    segments.oy[lane] = static_cast<float>(local.y);
    segments.oz[lane] = static_cast<float>(local.z);
  }
  RayScene::Hits16 hits;
  std::array<Vec3, 16> directions;
  Rgb sum{0.0};
  for (std::size_t first = 0; first < table.size(); first += 16) {
    for (std::size_t lane = 0; lane < 16; ++lane) {
      const Vec3& d = table[first + lane];
      directions[lane] = d.x * across + d.y * along + d.z * normal;
      segments.dx[lane] = static_cast<float>(directions[lane].x);
      segments.dy[lane] = static_cast<float>(directions[lane].y);
      segments.dz[lane] = static_cast<float>(directions[lane].z);
    }
    trace.rays().nearest16(segments, 0xffff, hits);
    for (std::size_t lane = 0; lane < 16; ++lane) {
      if (hits.surface[lane] == RayScene::no_surface) continue;
      const double distance = hits.distance[lane];
      const SurfacePoint at =
          trace.surface_point(hits.surface[lane], (hits.front_bits >> lane) & 1, start + distance * directions[lane]);
      if (scatters_[at.surface] || distance < near_)
        sum += seen_radiosity(at, directions[lane], distance, mix64(mixed + first + lane), rays);
      else
        sum += scene_->reflected_radiosity(at, distance);
    }
  }
  rays += table.size();
  return sum / static_cast<double>(table.size());
}

Rgb FinalGather::seen_radiosity(SurfacePoint at, Vec3 direction, double distance, std::uint64_t seed,
                                std::uint64_t& rays) const {
  const TraceScene& trace = scene_->trace();
  Random random(seed, 13);
  Rgb sum{0.0}, throughput{1.0};
  bool is_counted = false;                                   // the luminaire met next
  bool emission_counts = false;                              // until the ray leaves the ways that shadow rays know:
  bool knows_mirror = scene_->direct().has_mirror_images();  // straight ones, and those by way of one mirror
  for (int bounce = 0; bounce < most_bounces; ++bounce) {
    const Surface& surface = trace.scene().surfaces[at.surface];
    const Material& material = trace.scene().material_of(surface);
    if (emission_counts && !is_counted && !at.back) sum += throughput * std::numbers::pi * material.radiance;
    is_counted = false;
    Vec3 from = trace.lifted(at);
    if (material.finish == Finish::glass) {
      sum += throughput * std::numbers::pi * trace.luminaire_in_glass(at, direction, rays);
      const auto way = trace.way_at_glass(at, direction, random.unit());
      if (!way) return sum;
      from = way->from, direction = way->direction;
      is_counted = way->is_reflected;
      if (way->is_reflected) emission_counts = true, knows_mirror = false;
    } else {
      const Rgb diffuse = reflectance_at(trace.scene(), surface, at.point), share = specular_share(material, diffuse);
      const bool is_specular = max_channel(share) > 0;
      if (distance < near_ && !is_specular && bounce + 1 < most_bounces &&
          max_channel(throughput * diffuse) >= least_throughput) {
        // Too near: light this point itself, and look on from it. What would not matter any more takes what the element says:
        // dropped, it would be missing in every corner.
        throughput *= diffuse;
        sum += throughput * scene_->direct().irradiance(at.point, at.normal, {4, 1, random.bits(), 0}, rays);
        Vec3 tangent, bitangent;
        complete_frame(at.normal, tangent, bitangent);
        const double x = random.unit(), y = random.unit();
        const Vec3 local = cosine_direction({x, y});
        direction = local.x * tangent + local.y * bitangent + std::max(local.z, 1e-4) * at.normal;
        emission_counts = knows_mirror = false;
        const auto next = trace.nearest(from, direction);
        ++rays;
        if (!next) return sum;
        distance = glm::length(next->point - from);
        at = *next;
        continue;
      }
      sum += throughput * scene_->reflected_radiosity(at, distance);
      if (!is_specular) return sum;
      const Vec3 mirror = mirrored(direction, at.normal);
      throughput *= share;
      if (material.finish == Finish::glossy) {
        direction = phong_direction(mirror, material.exponent, {random.unit(), random.unit()});
        const double cosine = glm::dot(direction, at.normal);
        if (cosine <= 0) return sum;
        throughput *= phong_weight(cosine, material.exponent);
        knows_mirror = false;
      } else {
        direction = mirror;
      }
      emission_counts = !knows_mirror;
      knows_mirror = false;
    }
    if (max_channel(throughput) < least_throughput) return sum;
    const auto next = trace.nearest(from, direction);
    ++rays;
    if (!next) return sum;
    distance = glm::length(next->point - from);
    at = *next;
  }
  return sum;
}

}  // namespace lichthof
