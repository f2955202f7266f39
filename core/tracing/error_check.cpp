#include "core/tracing/error_check.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "core/base/check.hpp"
#include "core/base/random.hpp"
#include "core/tracing/diffuse_landing.hpp"
#include "core/tracing/path_tracer.hpp"

namespace lichthof {

namespace {

constexpr std::uint32_t rays_of_a_landing = 16;
constexpr std::size_t points_per_task = 4, luminaires_a_ray = 4;  // that cost as much to consider
constexpr std::uint32_t most_batches = 1024;                      // of a point
constexpr std::uint32_t least_batches = 192;                      // of all points: of fewer the noise is not known
constexpr std::uint32_t least_paths = 64;                         // of a point
constexpr std::uint32_t paths_a_batch = 64;                       // for the end of all patience
constexpr double least_of_mean = 0.01;  // darker places count as this share of the mean: the norm of each
constexpr double least_of_high = 1 / 1.5;
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
    std::vector<DiffuseLanding> landings;
    truth.read = look_around(point, options_.gather_rays, random, landings, rays);
    // One landing of each run of rays goes on: they are neighbours on the square, so the walks spread over the hemisphere.
    for (std::uint32_t walk = 0; walk < options_.walks; ++walk) {
      const auto first = landings.size() * walk / options_.walks, last = landings.size() * (walk + 1) / options_.walks;
      const DiffuseLanding& landing = landings[first + random.below(static_cast<std::uint32_t>(last - first))];
      if (landing.met)
        truth.correction +=
            landing.weight * error_of_solution(landing.at, random, rays) / static_cast<double>(options_.walks);
    }
    return truth;
  }

 private:
  Rgb direct(const SurfacePoint& point, DirectOptions options, Random& random, std::uint64_t& rays) const {
    options.seed = (std::uint64_t{random.bits()} << 32) | random.bits();
    rays += scene_.direct().luminaire_count() / luminaires_a_ray;
    return scene_.direct().irradiance(point.point, point.normal, options, rays);
  }

  /// G b̃ by `count` rays, one in each cell of a jittered grid. @returns the mean; where each ray landed
  Rgb look_around(const SurfacePoint& point, std::uint32_t count, Random& random, std::vector<DiffuseLanding>& landings,
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
    landings.assign(std::size_t{columns} * rows, DiffuseLanding{});
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
        DiffuseLanding& landing = landings[first + lane];
        landing.met = true;
        landing.at = trace.surface_point(hits.surface[lane], (hits.front_bits >> lane) & 1,
                                         start + static_cast<double>(hits.distance[lane]) * directions[lane]);
        if (scatters_on(trace, landing.at.surface))
          sum += follow(scene_, landing, glm::normalize(directions[lane]), random, rays);
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
    std::vector<DiffuseLanding> landings;
    for (;;) {
      const Rgb reflectance = reflectance_at(scene, scene.surfaces[at.surface], at.point);
      const Rgb arriving =
          direct(at, {16, 4, {}, 4}, random, rays) + look_around(at, rays_of_a_landing, random, landings, rays);
      sum += throughput * (reflectance * arriving - scene_.reflected_radiosity(at, far_away));
      throughput *= reflectance;
      const double go_on = std::min(0.95, max_channel(throughput));
      if (!(random.unit() < go_on)) return sum;
      throughput /= go_on;
      const DiffuseLanding& next = landings[random.below(static_cast<std::uint32_t>(landings.size()))];
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

/// What a witness found, with the variance of that.
struct Found {
  Rgb mean{0.0}, variance{0.0};
};
Found found(const Rgb& sum, const Rgb& squares, double n) {
  const Rgb mean = sum / n;
  return {mean, glm::max(squares / n - mean * mean, Rgb{0.0}) / (n - 1)};
}

/// What is said at a point beside what a witness found there: squares summed over the channels.
struct Deviation {
  double factor = 1;  ///< what the point's squares count for
  double square = 0;  ///< of the difference,
  double noise = 0;   ///< and what of it the witness's noise is
  double exact = 0;   ///< of the truth
  double whole = 0;   ///< what the point adds to that which errors are relative to
  double unbiased() const { return factor * (square - noise); }
};

Deviation deviation(const CheckPoint& point, const Rgb& said, const Found& found, double white) {
  Deviation d;
  for (int c = 0; c < 3; ++c) {
    const double mean = std::min(point.share[c] * found.mean[c], white);
    const double noise = mean < white ? point.share[c] * point.share[c] * found.variance[c] : 0.0;
    const double off = std::min(point.share[c] * said[c], white) - mean;
    d.square += off * off, d.noise += noise, d.exact += mean * mean - noise;
  }
  return d;
}

/// Weighs each point as the norm says.
void weigh(std::span<Deviation> deviations, const CheckPoints& places) {
  double mean = 0, weight = 0;
  for (std::size_t i = 0; i < deviations.size(); ++i) {
    mean += places.points[i].weight * std::sqrt(std::max(deviations[i].exact, 0.0));
    weight += places.points[i].weight;
  }
  const double floor = least_of_mean * mean / weight;
  for (std::size_t i = 0; i < deviations.size(); ++i) {
    Deviation& d = deviations[i];
    d.factor = d.whole = places.points[i].weight;
    if (places.norm == ErrorNorm::of_all)
      d.whole *= d.exact;
    else
      d.factor /= std::max(std::max(d.exact, 0.0) + floor * floor, 1e-300);
  }
}

struct Interval {
  double square = 0, low = 0, high = 0, noise = 0;  ///< squares
  double whole = 0;
};

/// The mean square, with 95 % confidence. Of the square of a sum of a deviation and noise of variance N, less N, the variance is
/// 4 D² N + 2 N² where the noise of all channels is one; a rare bright path that one point has met makes it wide by itself.
Interval interval(std::span<const Deviation> deviations, bool is_all) {
  Interval result;
  for (const Deviation& d : deviations) {
    result.square += d.unbiased(), result.noise += d.factor * d.noise, result.whole += d.whole;
  }
  if (!(result.whole > 0)) return {};
  result.square /= result.whole, result.noise /= result.whole;
  double by_noise = 0, by_spread = 0;
  const auto count = static_cast<double>(deviations.size());
  for (const Deviation& d : deviations) {
    const double off = std::sqrt(std::max(d.square - d.noise, 0.0));
    by_noise += d.factor * d.factor * (4 * off * off * d.noise + 2 * d.noise * d.noise);
    const double stray = d.unbiased() - result.square * d.whole;
    by_spread += stray * stray * count / (count - 1);
  }
  const double variance = is_all ? by_noise : std::max(by_noise, by_spread);
  const double half_width = 1.96 * std::sqrt(variance) / result.whole;
  result.low = result.square - half_width, result.high = result.square + half_width;
  return result;
}

double root(double square) { return std::sqrt(std::max(square, 0.0)); }

Interval interval_of(const CheckPoints& places, std::span<const Found> truth, std::span<const PointLight> given) {
  std::vector<Deviation> deviations(truth.size());
  for (std::size_t i = 0; i < truth.size(); ++i)
    deviations[i] = deviation(places.points[i], given[i].total(), truth[i], places.white);
  weigh(deviations, places);
  return interval(deviations, places.is_all);
}

/// Paths that never read the solution, and what they say so far.
class PathWitness {
 public:
  PathWitness(const std::shared_ptr<const LitScene>& scene, const CheckPoints& places, std::uint64_t seed)
      : tracer_(scene), places_(places), seed_(seed), sums_(places.points.size()) {}

  void look_longer(std::uint32_t paths, const Parallel& parallel) {
    std::vector<std::uint64_t> rays(sums_.size(), 0);
    parallel.for_each(sums_.size(), [&](std::size_t i) {
      const SurfacePoint& at = places_.points[i].at;
      const std::uint64_t seed = mix64(mix64(seed_ + i) + count_);
      const Estimate found = tracer_.irradiance({at.point, at.normal}, paths, seed, rays[i]);
      const Rgb deviation = found.standard_error * std::sqrt(paths - 1.0);
      sums_[i].sum += static_cast<double>(paths) * found.mean;
      sums_[i].squares += static_cast<double>(paths) * (deviation * deviation + found.mean * found.mean);
    });
    for (const std::uint64_t of_point : rays) rays_ += of_point;
    count_ += paths;
  }

  Interval interval(std::span<const PointLight> given) const {
    std::vector<Found> truth;
    for (const Sum& sum : sums_) truth.push_back(found(sum.sum, sum.squares, count_));
    return interval_of(places_, truth, given);
  }
  std::uint32_t count() const { return count_; }  ///< of each point
  std::uint64_t rays() const { return rays_; }

 private:
  struct Sum {
    Rgb sum{0.0}, squares{0.0};
  };
  PathTracer tracer_;
  const CheckPoints& places_;
  std::uint64_t seed_, rays_ = 0;
  std::uint32_t count_ = 0;
  std::vector<Sum> sums_;
};

/// Residual walks, and what they say so far.
class WalkWitness {
 public:
  WalkWitness(const LitScene& scene, const CheckPoints& places, const ErrorCheckOptions& options)
      : walks_(scene, options), places_(places), seed_(options.seed), sums_(places.points.size()) {}

  void look_longer(std::uint32_t batches, const Parallel& parallel) {
    const std::size_t count = sums_.size(), tasks = (count + points_per_task - 1) / points_per_task;
    std::vector<std::uint64_t> rays(tasks, 0);
    parallel.for_each(tasks, [&](std::size_t task) {
      const std::size_t last = std::min(count, (task + 1) * points_per_task);
      for (std::size_t i = task * points_per_task; i < last; ++i)
        for (std::uint32_t batch = batches_; batch < batches_ + batches; ++batch) {
          Random random(mix64(mix64(seed_ + i) + batch), 19);
          sums_[i].add(walks_.at(places_.points[i].at, random, rays[task]));
        }
    });
    for (const std::uint64_t of_task : rays) rays_ += of_task;
    batches_ += batches;
  }

  Interval interval(std::span<const PointLight> given) const {
    std::vector<Found> truth;
    for (const Sums& sums : sums_) {
      const Truth& t = sums.first;
      truth.push_back(found(t.direct + t.read + t.correction, sums.total_squares, batches_));
    }
    return interval_of(places_, truth, given);
  }
  std::span<const Sums> sums() const { return sums_; }
  std::uint32_t count() const { return batches_; }  ///< of each point
  std::uint64_t rays() const { return rays_; }

 private:
  ResidualWalks walks_;
  const CheckPoints& places_;
  std::uint64_t seed_, rays_ = 0;
  std::uint32_t batches_ = 0;
  std::vector<Sums> sums_;
};

/// What the walks know of the parts of the error, and its sign.
ErrorEstimate parts(const CheckPoints& places, std::span<const Sums> sums, std::span<const PointLight> given,
                    std::uint32_t batches) {
  const double n = batches;
  std::vector<Deviation> deviations(sums.size());
  double said = 0, exact = 0;
  for (std::size_t i = 0; i < sums.size(); ++i) {
    const CheckPoint& point = places.points[i];
    const Truth& t = sums[i].first;
    const Found all = found(t.direct + t.read + t.correction, sums[i].total_squares, n);
    deviations[i] = deviation(point, given[i].total(), all, places.white);
    said += point.weight * sum_channels(glm::min(point.share * given[i].total(), Rgb{places.white}));
    exact += point.weight * sum_channels(glm::min(point.share * all.mean, Rgb{places.white}));
  }
  weigh(deviations, places);
  double visibility = 0, indirect = 0, solution = 0;
  for (std::size_t i = 0; i < sums.size(); ++i) {
    const auto of_part = [&](const Rgb& sum, const Rgb& squares, const Rgb& of) {
      const Deviation d = deviation(places.points[i], of, found(sum, squares, n), 1e300);
      return deviations[i].factor * (d.square - d.noise);
    };
    const Truth& t = sums[i].first;
    visibility += of_part(t.direct, sums[i].direct_squares, given[i].direct);
    indirect += of_part(t.read + t.correction, sums[i].indirect_squares, given[i].indirect);
    solution += of_part(t.correction, sums[i].correction_squares, Rgb{0.0});
  }
  const double whole = interval(deviations, places.is_all).whole;
  ErrorEstimate result;
  result.points = static_cast<std::uint32_t>(sums.size()), result.batches = batches;
  if (!(whole > 0)) return result;
  result.bias = exact > 0 ? said / exact - 1 : 0;
  result.visibility = root(visibility / whole), result.indirect = root(indirect / whole);
  result.solution = root(solution / whole);
  return result;
}

/// The answer is known: all above or all below what is wanted, or with little noise beside it.
bool is_decided(const Interval& range, const ErrorCheckOptions& options) {
  const double aim = std::max(root(range.square), options.least), noise = root(range.noise);
  if (options.wanted > 0 && root(range.high) <= options.wanted) return true;
  return noise <= (options.wanted > 0 && root(range.low) >= options.wanted ? 1.0 : 0.5) * aim;
}

}  // namespace

ErrorEstimate check_error(const std::shared_ptr<const LitScene>& scene, const CheckPoints& places,
                          std::span<const PointLight> given, const ErrorCheckOptions& options,
                          const Parallel& parallel) {
  MUST(places.points.size() == given.size() && scene->has_solution());
  if (places.points.empty()) return {};
  const auto count = static_cast<std::uint32_t>(places.points.size());
  PathWitness paths(scene, places, options.seed);
  WalkWitness walks(*scene, places, options);
  paths.look_longer(std::max(options.paths / count, least_paths), parallel);
  walks.look_longer(std::max(2u, least_batches / count), parallel);
  Interval by_paths = paths.interval(given), by_walks = walks.interval(given);
  // What either still needs falls with the square of its noise: the cheaper one goes on.
  for (;;) {
    const bool paths_lead =
        by_paths.noise * static_cast<double>(paths.rays()) < by_walks.noise * static_cast<double>(walks.rays());
    if (is_decided(paths_lead ? by_paths : by_walks, options)) break;
    if (options.most_rays > 0 && paths.rays() + walks.rays() >= options.most_rays) break;
    if ((paths_lead ? paths.count() / paths_a_batch : walks.count()) >= most_batches) break;
    if (paths_lead)
      paths.look_longer(paths.count() / 2, parallel), by_paths = paths.interval(given);
    else
      walks.look_longer((walks.count() + 1) / 2, parallel), by_walks = walks.interval(given);
  }
  ErrorEstimate result = parts(places, walks.sums(), given, walks.count());
  // Walks that have not met a residual know neither error nor noise: where paths contradict them, paths are right.
  result.by_paths = by_paths.noise < by_walks.noise || by_paths.low > by_walks.high;
  const Interval& range = result.by_paths ? by_paths : by_walks;
  result.low = root(range.low), result.high = root(range.high), result.noise = root(range.noise);
  result.likely = root(range.square);
  result.error = std::max(result.likely, least_of_high * result.high);
  result.rays = paths.rays() + walks.rays();
  return result;
}

}  // namespace lichthof
