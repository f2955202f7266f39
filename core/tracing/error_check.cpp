#include "core/tracing/error_check.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "core/base/check.hpp"
#include "core/base/random.hpp"
#include "core/scene/polygon.hpp"
#include "core/tracing/scattering.hpp"

namespace lichthof {

namespace {

constexpr std::uint32_t rays_of_a_landing = 16;
constexpr int most_bounces = 12;           // between mirrors and panes
constexpr double least_throughput = 1e-3;  // what carries less is not followed
constexpr std::size_t points_per_task = 4;
constexpr double far_away = 1e300;  // the solution is read element by element, so that the residual has no other part

/// Parts of the truth at a point (W/m²).
struct Truth {
  Rgb direct{0.0};      ///< D
  Rgb read{0.0};        ///< G b̃
  Rgb correction{0.0};  ///< G e
};

class ResidualWalks {
 public:
  ResidualWalks(const LitScene& scene, const ErrorCheckOptions& options) : scene_(scene), options_(options) {}

  Truth at(const SurfacePoint& point, Random& random, std::uint64_t& rays) const {
    Truth truth;
    truth.direct = direct(point, {64, 16, {}, 16}, random, rays);
    std::vector<Landing> landings;
    truth.read = look_around(point, options_.gather_rays, random, landings, rays);
    // One landing of each run of rays goes on: they are neighbours on the square, so the walks spread over the hemisphere.
    for (std::uint32_t walk = 0; walk < options_.walks; ++walk) {
      const auto first = landings.size() * walk / options_.walks, last = landings.size() * (walk + 1) / options_.walks;
      const Landing& landing = landings[first + random.below(static_cast<std::uint32_t>(last - first))];
      if (landing.met)
        truth.correction +=
            landing.weight * error_of_solution(landing.at, random, rays) / static_cast<double>(options_.walks);
    }
    return truth;
  }

 private:
  /// Where a ray ends on a surface that scatters diffusely, after mirrors and panes.
  struct Landing {
    SurfacePoint at;
    bool met = false;
    Rgb weight{1.0};  ///< what the way there leaves of the light, over the probability of the way
  };

  Rgb direct(const SurfacePoint& point, DirectOptions options, Random& random, std::uint64_t& rays) const {
    options.seed = (std::uint64_t{random.bits()} << 32) | random.bits();
    return scene_.direct().irradiance(point.point, point.normal, options, rays);
  }

  bool scatters(std::uint32_t surface) const {
    const Scene& scene = scene_.trace().scene();
    const Material& material = scene.material_of(scene.surfaces[surface]);
    return material.finish == Finish::glass || is_specular(material);
  }

  /// Follows a ray that has met a mirror, gloss or glass to where it lands; one way is drawn where there are several.
  /// @returns what it sees of luminaires on the way that shadow rays do not know (π L, W/m²)
  Rgb follow(Landing& landing, Vec3 direction, Random& random, std::uint64_t& rays) const {
    const TraceScene& trace = scene_.trace();
    const Scene& scene = trace.scene();
    Rgb seen{0.0};
    bool emission_counts = false, is_counted = false, knows_mirror = scene_.direct().has_mirror_images();
    for (int bounce = 0; bounce < most_bounces; ++bounce) {
      const SurfacePoint at = landing.at;
      const Surface& surface = scene.surfaces[at.surface];
      const Material& material = scene.material_of(surface);
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
        const Rgb diffuse = reflectance_at(scene, surface, at.point), share = specular_share(material, diffuse);
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

  /// G b̃ by `count` rays, one in each cell of a jittered grid. @returns the mean; where each ray landed
  Rgb look_around(const SurfacePoint& point, std::uint32_t count, Random& random, std::vector<Landing>& landings,
                  std::uint64_t& rays) const {
    const TraceScene& trace = scene_.trace();
    const auto columns = static_cast<std::uint32_t>(std::lround(std::sqrt(count)));
    const std::uint32_t rows = count / columns;
    Vec3 tangent, bitangent;
    complete_frame(point.normal, tangent, bitangent);
    const Vec3 start = trace.lifted(point), local = start - trace.rays().origin();
    Segments16 segments;
    clear_segments(segments);
    std::fill_n(segments.ox, 16, static_cast<float>(local.x));
    std::fill_n(segments.oy, 16, static_cast<float>(local.y));
    std::fill_n(segments.oz, 16, static_cast<float>(local.z));
    landings.assign(std::size_t{columns} * rows, Landing{});
    Rgb sum{0.0};
    std::array<Vec3, 16> directions;
    RayScene::Hits16 hits;
    for (std::size_t first = 0; first < landings.size(); first += 16) {
      const auto lanes = static_cast<std::uint32_t>(std::min<std::size_t>(16, landings.size() - first));
      for (std::uint32_t lane = 0; lane < lanes; ++lane) {
        const auto cell = static_cast<std::uint32_t>(first) + lane;
        const double x = random.unit(), y = random.unit();
        const Vec3 d = cosine_direction({(cell / rows + x) / columns, (cell % rows + y) / rows});
        directions[lane] = d.x * tangent + d.y * bitangent + std::max(d.z, 1e-6) * point.normal;
        segments.dx[lane] = static_cast<float>(directions[lane].x);
        segments.dy[lane] = static_cast<float>(directions[lane].y);
        segments.dz[lane] = static_cast<float>(directions[lane].z);
      }
      trace.rays().nearest16(segments, (1u << lanes) - 1, hits);
      for (std::uint32_t lane = 0; lane < lanes; ++lane) {
        if (hits.surface[lane] == RayScene::no_surface) continue;
        Landing& landing = landings[first + lane];
        landing.met = true;
        landing.at = trace.surface_point(hits.surface[lane], (hits.front_bits >> lane) & 1,
                                         start + static_cast<double>(hits.distance[lane]) * directions[lane]);
        if (scatters(landing.at.surface)) sum += follow(landing, glm::normalize(directions[lane]), random, rays);
        if (landing.met) sum += landing.weight * scene_.reflected_radiosity(landing.at, far_away);
      }
    }
    rays += landings.size();
    return sum / static_cast<double>(landings.size());
  }

  /// e at a point, by a walk that gathers the residual at each step (W/m²).
  Rgb error_of_solution(SurfacePoint at, Random& random, std::uint64_t& rays) const {
    const Scene& scene = scene_.trace().scene();
    Rgb sum{0.0}, throughput{1.0};
    std::vector<Landing> landings;
    for (;;) {
      const Rgb reflectance = reflectance_at(scene, scene.surfaces[at.surface], at.point);
      const Rgb arriving =
          direct(at, {16, 4, {}, 4}, random, rays) + look_around(at, rays_of_a_landing, random, landings, rays);
      sum += throughput * (reflectance * arriving - scene_.reflected_radiosity(at, far_away));
      throughput *= reflectance;
      const double go_on = std::min(0.95, max_channel(throughput));
      if (!(random.unit() < go_on)) return sum;
      throughput /= go_on;
      const Landing& next = landings[random.below(static_cast<std::uint32_t>(landings.size()))];
      if (!next.met) return sum;
      throughput *= next.weight;
      at = next.at;
    }
  }

  const LitScene& scene_;
  ErrorCheckOptions options_;
};

/// Sums over the batches of a point.
struct Sums {
  Truth first;
  Rgb total_squares{0.0}, direct_squares{0.0}, indirect_squares{0.0}, correction_squares{0.0};
  void add(const Truth& t) {
    first.direct += t.direct, first.read += t.read, first.correction += t.correction;
    const Rgb indirect = t.read + t.correction, total = t.direct + indirect;
    total_squares += total * total, direct_squares += t.direct * t.direct;
    indirect_squares += indirect * indirect, correction_squares += t.correction * t.correction;
  }
};

/// Square of a deviation summed over the channels, and of it what the noise of a mean of n batches adds.
struct Square {
  double square = 0, noise = 0;
  double without_noise() const { return square - noise; }
};
Square square_of(const Rgb& sum, const Rgb& squares, double n, const Rgb& given) {
  const Rgb mean = sum / n, variance = glm::max(squares / n - mean * mean, Rgb{0.0}) / (n - 1);
  return {glm::dot(given - mean, given - mean), sum_channels(variance)};
}

ErrorEstimate estimate(std::span<const CheckPoint> points, std::span<const Sums> sums,
                       std::span<const PointLight> given, std::uint32_t batches) {
  const double n = batches, count = static_cast<double>(sums.size());
  double error = 0, exact = 0, visibility = 0, indirect = 0, solution = 0, noise = 0, mean_given = 0, mean_exact = 0;
  std::vector<double> errors, exacts;  // of each point
  for (std::size_t i = 0; i < sums.size(); ++i) {
    const Truth& t = sums[i].first;
    const double weight = points[i].weight;
    const Rgb total = t.direct + t.read + t.correction, said = given[i].direct + given[i].indirect;
    const Square all = square_of(total, sums[i].total_squares, n, said);
    errors.push_back(weight * all.without_noise());
    exacts.push_back(weight * (glm::dot(total / n, total / n) - all.noise));
    error += errors.back(), exact += exacts.back(), noise += weight * all.noise;
    visibility += weight * square_of(t.direct, sums[i].direct_squares, n, given[i].direct).without_noise();
    indirect +=
        weight * square_of(t.read + t.correction, sums[i].indirect_squares, n, given[i].indirect).without_noise();
    solution += weight * square_of(t.correction, sums[i].correction_squares, n, Rgb{0.0}).without_noise();
    mean_given += weight * sum_channels(said), mean_exact += weight * sum_channels(total / n);
  }
  ErrorEstimate result;
  result.points = static_cast<std::uint32_t>(sums.size()), result.batches = batches;
  if (!(exact > 0)) return result;
  // Of a ratio of two means over the same points.
  const double square = error / exact;
  double spread = 0;
  for (std::size_t i = 0; i < errors.size(); ++i) {
    const double stray = (errors[i] - square * exacts[i]) / (exact / count);
    spread += stray * stray / (count * (count - 1));
  }
  const double half_width = 1.96 * std::sqrt(spread);
  const auto root = [](double of) { return std::sqrt(std::max(of, 0.0)); };
  result.error = root(square);
  result.low = root(square - half_width), result.high = root(square + half_width);
  result.bias = mean_exact > 0 ? mean_given / mean_exact - 1 : 0;
  result.visibility = root(visibility / exact), result.indirect = root(indirect / exact);
  result.solution = root(solution / exact), result.noise = root(noise / exact);
  return result;
}

}  // namespace

std::vector<CheckPoint> random_surface_points(const LitScene& scene, std::uint32_t count, std::uint64_t seed) {
  MUST(scene.has_solution());
  const Scene& input = scene.trace().scene();
  const Mesh& mesh = scene.mesh();
  struct Piece {
    std::uint32_t patch;
    double area, power;  ///< m²; W that arrives
  };
  std::vector<Piece> pieces;
  double area = 0, power = 0;
  for (std::uint32_t p = 0; p < mesh.patches.size(); ++p) {
    const Patch& patch = mesh.patches[p];
    if (!mesh.group_is_lit[patch.group.value]) continue;
    if (input.material_of(input.surfaces[patch.surface.value]).finish == Finish::glass) continue;
    const Rgb arriving = scene.total_irradiance({patch.surface.value, patch.back, patch.centre, {}});
    pieces.push_back({p, patch.area, patch.area * sum_channels(arriving)});
    area += patch.area, power += pieces.back().power;
  }
  const auto share = [&](const Piece& piece) {
    return power > 0 ? 0.5 * (piece.area / area + piece.power / power) : piece.area / area;
  };
  std::vector<CheckPoint> points;
  Random random(seed, 17);
  const double turn = random.unit();
  std::size_t next = 0;
  double up_to = pieces.empty() ? 0 : share(pieces[0]);
  for (std::uint32_t i = 0; i < count && !pieces.empty(); ++i) {
    while (up_to < (i + turn) / count && next + 1 < pieces.size()) up_to += share(pieces[++next]);
    const Piece& piece = pieces[next];
    const Patch& patch = mesh.patches[piece.patch];
    const Surface& surface = input.surfaces[patch.surface.value];
    const Plane& plane = mesh.planes[patch.plane.value];
    Polygon corners;
    for (const Vec2& corner : mesh.polygon(patch.polygon)) corners.push_back(plane.point(corner));
    points.push_back({{patch.surface.value, patch.back, random_place(corners, patch.area, random),
                       patch.back ? -surface.normal : surface.normal},
                      piece.area / area / share(piece)});
  }
  return points;
}

ErrorEstimate check_error(const std::shared_ptr<const LitScene>& scene, std::span<const CheckPoint> points,
                          std::span<const PointLight> given, const ErrorCheckOptions& options,
                          const Parallel& parallel) {
  MUST(points.size() == given.size() && scene->has_solution() && options.most_batches >= 2);
  if (points.size() < 2) return {};
  const ResidualWalks walks(*scene, options);
  const std::size_t tasks = (points.size() + points_per_task - 1) / points_per_task;
  std::vector<Sums> sums(points.size());
  std::vector<std::uint64_t> rays(tasks, 0);
  ErrorEstimate result;
  std::uint32_t batches = 0;
  while (batches < options.most_batches) {
    const std::uint32_t more = std::max(2u, batches / 2);
    parallel.for_each(tasks, [&](std::size_t task) {
      const std::size_t last = std::min(points.size(), (task + 1) * points_per_task);
      for (std::size_t i = task * points_per_task; i < last; ++i)
        for (std::uint32_t batch = batches; batch < batches + more; ++batch) {
          const std::uint64_t seed = mix64(mix64(options.seed + i) + batch);
          Random random(seed, 19);
          sums[i].add(walks.at(points[i].at, random, rays[task]));
        }
    });
    batches += more;
    result = estimate(points, sums, given, batches);
    // With as much noise as error the estimate spreads by sqrt(2/points) of itself; less noise is for what has to be decided.
    const bool is_decided = result.high <= options.wanted || result.low >= options.wanted;
    const double aim = std::max(result.error, options.least);
    if (result.noise <= (is_decided ? 1.2 : 0.5) * aim) break;
  }
  for (const std::uint64_t count : rays) result.rays += count;
  return result;
}

}  // namespace lichthof
