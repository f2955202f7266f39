#include "core/tracing/direct_light.hpp"

#include <algorithm>
#include <cmath>
#include <deque>
#include <numbers>

#include "core/base/check.hpp"
#include "core/light/form_factor.hpp"
#include "core/tracing/shining_place.hpp"

namespace lichthof {

namespace {

constexpr std::array<std::uint32_t, 4> parts_of_level{1, 4, 16, 64};
/// Nearer than this many radii the form factor of a part is taken in closed form, beyond from its centre.
constexpr double near_part = 5.0;
/// Beyond this many radii the form factor of a whole luminaire is first guessed from its centre.
constexpr double far_luminaire = 20.0;
/// Luminaires beyond the strongest that together bring this share of the light are not given rays of their own.
constexpr double unimportant_share = 1e-3;
/// A luminaire that would fill less than this share of the view is met too seldom by rays that look around to be shared with them.
constexpr double least_shared = 1e-3;
/// Places cannot be drawn by the light they bring on a part that is wider than this many distances to its plane, and near: most of that
/// comes from a small spot of it. Rays that look around find such a luminaire all the same, since it is large.
constexpr double widest_part = 3.0;
/// Where luminaires fill more than this share of the view, one ray to one of them is too noisy a tale.
constexpr double most_of_view = 0.2;
/// Rays of the look that tells which luminaires are hidden, at most to one, and bounds of those that sample them.
constexpr std::uint32_t look_rays = 64, most_look_rays = 16, least_samples = 16, most_samples = 128;
/// More parts than this in all, and luminaires get fewer levels.
constexpr std::size_t part_budget = 400000;

std::uint64_t seed_of(std::uint64_t seed, std::uint32_t round) { return round == 0 ? seed : mix64(seed + round); }

/// Shadow rays collected until sixteen can leave at once.
class ShadowRays {
 public:
  ShadowRays(const TraceScene& scene, const Vec3& origin) : scene_(scene), origin_(origin) {
    clear_segments(segments_);
    const Vec3 local = origin - scene.clear_rays().origin();
    for (int lane = 0; lane < 16; ++lane) {
      segments_.ox[lane] = static_cast<float>(local.x);
      segments_.oy[lane] = static_cast<float>(local.y);
      segments_.oz[lane] = static_cast<float>(local.z);
    }
  }

  /// @param got  the share of light that comes through is written there (1)
  void add(const Vec3& target, double& got) {
    const Vec3 way = target - origin_;
    segments_.dx[used_] = static_cast<float>(way.x);
    segments_.dy[used_] = static_cast<float>(way.y);
    segments_.dz[used_] = static_cast<float>(way.z);
    targets_[used_] = target;
    got_[used_] = &got;
    if (++used_ == 16) flush();
  }

  void flush() {
    if (used_ == 0) return;
    const std::uint32_t active = used_ == 16 ? 0xffffu : (1u << used_) - 1;
    const std::uint32_t blocked = scene_.clear_rays().occluded16(segments_, active);
    for (std::uint32_t lane = 0; lane < used_; ++lane)
      *got_[lane] = (blocked >> lane) & 1 ? 0.0 : scene_.transmittance(origin_, targets_[lane]);
    count_ += used_;
    used_ = 0;
  }
  std::uint64_t count() const { return count_; }

 private:
  const TraceScene& scene_;
  Vec3 origin_;
  Segments16 segments_;
  std::array<Vec3, 16> targets_;
  std::array<double*, 16> got_;
  std::uint32_t used_ = 0;
  std::uint64_t count_ = 0;
};

}  // namespace

DirectLight::DirectLight(std::shared_ptr<const TraceScene> scene) : scene_(std::move(scene)), images_(scene_) {
  const Scene& input = scene_->scene();
  density_of_surface_.assign(input.surfaces.size(), 0.0);
  std::size_t count = 0;
  for (const Surface& surface : input.surfaces) count += input.material_of(surface).emits();
  int levels = level_count;
  while (levels > 1 && count * parts_of_level[static_cast<std::size_t>(levels - 1)] > part_budget) --levels;

  for (std::uint32_t s = 0; s < input.surfaces.size(); ++s) {
    const Surface& surface = input.surfaces[s];
    const Material& material = input.material_of(surface);
    if (!material.emits() || !(surface.area > 0)) continue;
    Luminaire luminaire;
    luminaire.surface = s;
    luminaire.radiance = material.radiance;
    luminaire.centre = centroid(std::span<const Vec3>(surface.corners));
    luminaire.normal = surface.normal;
    luminaire.area = surface.area;
    for (const Vec3& c : surface.corners)
      luminaire.radius = std::max(luminaire.radius, glm::length(c - luminaire.centre));
    add_parts(luminaire, surface, levels);
    const Rgb power = std::numbers::pi * surface.area * material.radiance;
    power_ += power;
    cumulative_.push_back((cumulative_.empty() ? 0.0 : cumulative_.back()) + sum_channels(power));
    luminaires_.push_back(luminaire);
  }
  for (std::size_t i = 0; i < luminaires_.size(); ++i) {
    const double own = cumulative_[i] - (i > 0 ? cumulative_[i - 1] : 0.0);
    density_of_surface_[luminaires_[i].surface] = own / cumulative_.back() / luminaires_[i].area;
  }
}

void DirectLight::add_parts(Luminaire& luminaire, const Surface& surface, int levels) {
  // A grid along the longest edge; cells that the polygon leaves empty do not count.
  Vec3 u{0.0};
  for (std::size_t k = 0; k < surface.corners.size(); ++k) {
    const Vec3 edge = surface.corners[(k + 1) % surface.corners.size()] - surface.corners[k];
    if (glm::dot(edge, edge) > glm::dot(u, u)) u = edge;
  }
  u = glm::normalize(u);
  const Vec3 v = glm::cross(surface.normal, u);
  Vec2 lo{1e300}, hi{-1e300};
  for (const Vec3& c : surface.corners) {
    const Vec2 p{glm::dot(c - luminaire.centre, u), glm::dot(c - luminaire.centre, v)};
    lo = glm::min(lo, p), hi = glm::max(hi, p);
  }
  const Vec2 size = hi - lo;
  const double fill = std::clamp(surface.area / (size.x * size.y), 0.1, 1.0);

  for (int level = 0; level < level_count; ++level) {
    luminaire.first_part[static_cast<std::size_t>(level)] = static_cast<std::uint32_t>(parts_.size());
    if (level >= levels) continue;
    const double wanted = parts_of_level[static_cast<std::size_t>(level)] / fill;
    int columns = level == 0 ? 1 : static_cast<int>(std::lround(std::sqrt(wanted * size.x / size.y)));
    columns = std::clamp(columns, 1, level == 0 ? 1 : static_cast<int>(std::lround(wanted)));
    const int rows = level == 0 ? 1 : std::max(1, static_cast<int>(std::lround(wanted / columns)));
    for (int row = 0; row < rows; ++row)
      for (int column = 0; column < columns; ++column) {
        const Vec2 from = lo + size * Vec2{column, row} / Vec2{columns, rows};
        const Vec2 to = lo + size * Vec2{column + 1, row + 1} / Vec2{columns, rows};
        Polygon piece = surface.corners;
        const double slack = 1e-9 * (size.x + size.y);
        const auto cut = [&](const Vec3& normal, double offset, bool needed) {
          if (needed && !piece.empty())
            piece = clipped(piece, normal, offset + glm::dot(normal, luminaire.centre), slack);
        };
        cut(u, from.x, column > 0), cut(-u, -to.x, column + 1 < columns);
        cut(v, from.y, row > 0), cut(-v, -to.y, row + 1 < rows);
        if (piece.empty()) continue;
        Part part;
        part.area = area(piece);
        if (part.area < 1e-9 * surface.area) continue;
        part.centre = centroid(std::span<const Vec3>(piece));
        for (const Vec3& c : piece) part.radius = std::max(part.radius, glm::length(c - part.centre));
        part.first_corner = static_cast<std::uint32_t>(corners_.size());
        part.corner_count = static_cast<std::uint32_t>(piece.size());
        corners_.insert(corners_.end(), piece.begin(), piece.end());
        parts_.push_back(part);
      }
  }
  luminaire.first_part[level_count] = static_cast<std::uint32_t>(parts_.size());
}

bool DirectLight::candidate(std::uint32_t index, const Vec3& point, const Vec3& normal, Candidate& out) const {
  const Luminaire& luminaire = luminaires_[index];
  const Vec3 way = luminaire.centre - point;
  const double behind = -glm::dot(luminaire.normal, way), height = glm::dot(normal, way);
  if (behind <= 0 || height + luminaire.radius <= 0) return false;
  out.luminaire = index;
  out.distance = glm::length(way);
  out.straddles = height < luminaire.radius;
  const Part& whole = parts_[luminaire.first_part[0]];
  if (out.distance > far_luminaire * luminaire.radius && !out.straddles) {
    const double d2 = out.distance * out.distance;
    out.form_factor = height * behind * luminaire.area / (std::numbers::pi * d2 * d2);
  } else {
    out.form_factor = form_factor(point, normal, corners(whole));
  }
  out.weight = sum_channels(luminaire.radiance) * out.form_factor;
  return out.weight > 0;
}

int DirectLight::level_for(const Candidate& candidate, double share, const DirectOptions& options) const {
  const Luminaire& luminaire = luminaires_[candidate.luminaire];
  double wanted = std::min<double>(options.rays * share, options.most_per_luminaire);
  // A small light far away throws sharp shadows: few rays show as much as many.
  const double apparent = luminaire.radius / candidate.distance;
  if (apparent < 0.01)
    wanted = std::min(wanted, 1.0);
  else if (apparent < 0.04)
    wanted = std::min(wanted, 4.0);
  else if (share > 0.02)
    wanted = std::max(wanted, std::min(4.0, static_cast<double>(options.most_per_luminaire)));
  int level = 0;
  while (level + 1 < level_count && parts_of_level[static_cast<std::size_t>(level) + 1] <= wanted * 1.34 &&
         luminaire.first_part[static_cast<std::size_t>(level) + 1] <
             luminaire.first_part[static_cast<std::size_t>(level) + 2])
    ++level;
  return level;
}

void DirectLight::bundle(std::vector<Candidate>& candidates, double total, const DirectOptions& options,
                         Random& random) const {
  const double worth_a_ray = total / options.rays;
  std::vector<Candidate> bundled;
  for (std::size_t first = 0, next = 0; first < candidates.size(); first = next) {
    double weight = 0;
    for (; next < candidates.size() && weight < worth_a_ray; ++next) {
      if (next > first && candidates[next].weight >= worth_a_ray) break;
      weight += candidates[next].weight;
    }
    double pick = (options.seed ? random.unit() : 0.5) * weight;
    std::size_t chosen = first;
    while (chosen + 1 < next && pick >= candidates[chosen].weight) pick -= candidates[chosen++].weight;
    Candidate& one = bundled.emplace_back(candidates[chosen]);
    if (next - first == 1) continue;
    one.is_bundle = true, one.weight = weight;
    one.form_factor = weight / sum_channels(luminaires_[one.luminaire].radiance);
  }
  candidates = std::move(bundled);
}

std::vector<DirectLight::Candidate> DirectLight::candidates(const Vec3& point, const Vec3& normal,
                                                            const DirectOptions& options, double& total) const {
  std::vector<Candidate> found;
  total = 0;
  for (std::uint32_t i = 0; i < luminaires_.size(); ++i)
    if (Candidate c; candidate(i, point, normal, c)) {
      found.push_back(c);
      total += c.weight;
    }
  Random random(options.seed.value_or(0), 17);
  if (2 * found.size() > options.rays) bundle(found, total, options, random);
  if (found.size() > 1)
    std::sort(found.begin(), found.end(), [](const Candidate& a, const Candidate& b) {
      return a.weight != b.weight ? a.weight > b.weight : a.luminaire < b.luminaire;
    });
  return found;
}

std::size_t DirectLight::important(std::span<const Candidate> candidates, double total) {
  std::size_t count = 0;
  for (double rest = total; count < candidates.size() && rest > unimportant_share * total; ++count)
    rest -= candidates[count].weight;
  return std::min(std::max<std::size_t>(count, 1), candidates.size());
}

template <class Call>
void DirectLight::for_each_aim(const Candidate& c, int level, const Vec3& point, const Vec3& normal,
                               Call&& call) const {
  const Luminaire& luminaire = luminaires_[c.luminaire];
  const auto l = static_cast<std::size_t>(level);
  for (std::uint32_t k = luminaire.first_part[l]; k < luminaire.first_part[l + 1]; ++k) {
    const Part& part = parts_[k];
    const Vec3 way = part.centre - point;
    const double d2 = glm::dot(way, way), height = glm::dot(normal, way);
    Aim aim{&part, 0, part.centre};
    if (c.straddles && height < part.radius) {
      aim.weight = form_factor(point, normal, corners(part));
      if (!(aim.weight > 0) || !visible_point(point, normal, corners(part), aim.target)) continue;
    } else {
      aim.weight = d2 < near_part * near_part * part.radius * part.radius
                       ? form_factor(point, normal, corners(part))
                       : height * -glm::dot(luminaire.normal, way) * part.area / (std::numbers::pi * d2 * d2);
      if (!(aim.weight > 0)) continue;
    }
    call(aim);
  }
}

std::vector<DirectLight::Seen> DirectLight::seen(std::span<const Candidate> candidates, double total, const Vec3& point,
                                                 const Vec3& normal, const DirectOptions& options,
                                                 std::uint64_t& rays) const {
  struct Ray {
    std::size_t candidate;
    double weight, got;
  };
  // A deque's entries stay where they are: shadow rays write into them.
  std::deque<Ray> cast;
  const double lift = scene_->offset();
  ShadowRays shadow(*scene_, point + lift * normal);
  for (std::uint32_t round = 0; round < options.rounds; ++round) {
    Random random(seed_of(options.seed.value_or(0), round), 7);
    for (std::size_t i = 0; i < candidates.size(); ++i) {
      const Vec3& facing = luminaires_[candidates[i].luminaire].normal;
      const int level = level_for(candidates[i], candidates[i].weight / total, options);
      for_each_aim(candidates[i], level, point, normal, [&](Aim& aim) {
        if (options.seed)
          aim.target = shining_place(corners(*aim.part), aim.part->area, facing, point, normal, aim.target, random);
        cast.push_back({i, aim.weight, 0});
        shadow.add(aim.target + lift * facing, cast.back().got);
      });
    }
  }
  shadow.flush();
  rays += shadow.count();

  std::vector<Seen> seen(candidates.size());
  for (std::size_t k = 0; k < cast.size(); ++k) {
    const Ray& ray = cast[k];
    Seen& sum = seen[ray.candidate];
    sum.whole += ray.weight, sum.visible += ray.weight * ray.got;
    sum.is_clear = sum.is_clear && ray.got > 0;
    // One ray a stratum: half the squared difference of neighbours stands for the variance within both.
    if (k > 0 && cast[k - 1].candidate == ray.candidate) {
      const double step = ray.weight * (ray.got - cast[k - 1].got);
      sum.variance += 0.5 * step * step;
    }
  }
  return seen;
}

Rgb DirectLight::by_mirrors(const Vec3& point, const Vec3& normal, const DirectOptions& options,
                            std::uint64_t& rays) const {
  Rgb sum{0.0};
  if (options.rays_per_image == 0 || images_.empty()) return sum;
  for (std::uint32_t round = 0; round < options.rounds; ++round)
    sum += images_.irradiance(point, normal, options.rays_per_image, seed_of(options.seed.value_or(1), round), rays);
  return sum / static_cast<double>(options.rounds);
}

Rgb DirectLight::irradiance(const Vec3& point, const Vec3& normal, const DirectOptions& options,
                            std::uint64_t& rays) const {
  Rgb sum = by_mirrors(point, normal, options, rays);
  double total = 0;
  const std::vector<Candidate> found = candidates(point, normal, options, total);
  if (!(total > 0)) return sum;
  const std::size_t traced = important(found, total);
  const std::vector<Seen> parts =
      seen(std::span<const Candidate>(found).first(traced), total, point, normal, options, rays);

  // The unimportant ones are as visible as the others on average.
  double got = 0, could = 0;
  for (std::size_t i = 0; i < found.size(); ++i) {
    const Candidate& c = found[i];
    double visibility;
    if (i < traced) {
      visibility = parts[i].whole > 0 ? parts[i].visible / parts[i].whole : 0.0;
      got += visibility * c.weight, could += c.weight;
    } else {
      visibility = could > 0 ? got / could : 0.0;
    }
    sum += std::numbers::pi * c.form_factor * visibility * luminaires_[c.luminaire].radiance;
  }
  return sum;
}

Rgb DirectLight::one_ray_irradiance(const Vec3& point, const Vec3& normal, Random& random, std::uint64_t& rays) const {
  // Draw a luminaire by a guess of what it brings that is nowhere nought where light comes from.
  double sum = 0, weight = 0, view = 0;
  const Luminaire* drawn = nullptr;
  for (const Luminaire& luminaire : luminaires_) {
    const Vec3 way = luminaire.centre - point;
    const double behind = -glm::dot(luminaire.normal, way), height = glm::dot(normal, way) + luminaire.radius;
    if (behind <= 0 || height <= 0) continue;
    const double d2 = glm::dot(way, way) + luminaire.radius * luminaire.radius;
    const double share = luminaire.area * behind * height / (std::numbers::pi * d2 * d2);
    const double guess = sum_channels(luminaire.radiance) * share;
    sum += guess, view += share;
    if (random.unit() * sum < guess) drawn = &luminaire, weight = guess;
  }
  if (!drawn) return Rgb{0.0};
  if (view > most_of_view) return irradiance(point, normal, {4, 1, random.bits(), 0}, rays);

  // A place on it: by area where it is far, by the light it brings where it is near.
  const Part& whole = parts_[drawn->first_part[0]];
  const Vec3 to_centre = whole.centre - point;
  const bool is_near = glm::dot(to_centre, to_centre) < near_part * near_part * whole.radius * whole.radius;
  Vec3 target = whole.centre;
  double factor = 0;
  if (is_near) {
    factor = form_factor(point, normal, corners(whole));
    if (!(factor > 0) || !visible_point(point, normal, corners(whole), target)) return Rgb{0.0};
    target = shining_place(corners(whole), whole.area, drawn->normal, point, normal, target, random);
  } else {
    target = random_place(corners(whole), whole.area, random);
    const Vec3 way = target - point;
    const double d2 = glm::dot(way, way);
    factor = std::max(0.0, glm::dot(normal, way)) * -glm::dot(drawn->normal, way) * whole.area /
             (std::numbers::pi * d2 * d2);
    if (!(factor > 0)) return Rgb{0.0};
  }
  ++rays;
  const Vec3 from = point + scene_->offset() * normal, to = target + scene_->offset() * drawn->normal;
  if (scene_->clear_rays().occluded(from, to)) return Rgb{0.0};
  return scene_->transmittance(from, to) * sum / weight * std::numbers::pi * factor * drawn->radiance;
}

DirectView DirectLight::view(const Vec3& point, const Vec3& normal, const DirectOptions& options,
                             std::uint64_t& rays) const {
  DirectView view;
  view.light = by_mirrors(point, normal, options, rays);
  const std::uint64_t seed = options.seed.value_or(0);
  double total = 0;
  const std::vector<Candidate> found = candidates(point, normal, options, total);
  if (!(total > 0)) return view;
  const std::size_t traced = important(found, total);

  // Look which of the large ones are hidden. Through solids light is bent: there shadow rays know ways that other rays do not find.
  std::vector<Candidate> alone, hidden;
  double hidden_weight = 0;
  DirectOptions look = options;
  look.rays = look_rays, look.most_per_luminaire = std::min(most_look_rays, options.most_per_luminaire);
  look.seed = mix64(seed ^ 1), look.rounds = 1;
  std::vector<Candidate> large;
  for (std::size_t i = 0; i < traced; ++i)
    (found[i].form_factor >= least_shared && !found[i].is_bundle && !scene_->has_solids() ? large : alone).push_back(found[i]);
  const std::vector<Seen> looked = seen(large, total, point, normal, look, rays);
  for (std::size_t i = 0; i < large.size(); ++i) {
    (looked[i].is_clear ? alone : hidden).push_back(large[i]);
    if (!looked[i].is_clear) hidden_weight += large[i].weight;
  }

  // The others by shadow rays; and the unimportant ones, as visible as all are on average.
  const std::vector<Seen> parts = seen(alone, total - hidden_weight, point, normal, options, rays);
  double got = 0, could = 0;
  for (std::size_t i = 0; i < large.size(); ++i)
    if (!looked[i].is_clear && looked[i].whole > 0)
      got += looked[i].visible / looked[i].whole * large[i].weight, could += large[i].weight;
  for (std::size_t i = 0; i < alone.size(); ++i) {
    if (!(parts[i].whole > 0)) continue;
    const Candidate& c = alone[i];
    const Rgb whole = std::numbers::pi * c.form_factor * luminaires_[c.luminaire].radiance;
    const double visibility = parts[i].visible / parts[i].whole, per_part = sum_channels(whole) / parts[i].whole;
    view.light += visibility * whole;
    view.variance += per_part * per_part * parts[i].variance;
    got += visibility * c.weight, could += c.weight;
  }
  for (std::size_t i = traced; i < found.size(); ++i)
    view.light += (could > 0 ? got / could : 0.0) * std::numbers::pi * found[i].form_factor *
                  luminaires_[found[i].luminaire].radiance;
  if (!hidden.empty()) {
    const auto share = static_cast<std::uint32_t>(options.rays * hidden_weight / total);
    add_shared(hidden, point, normal, std::clamp(options.rounds * share, least_samples, most_samples), mix64(seed ^ 2),
               view, rays);
  }
  return view;
}

void DirectLight::add_shared(std::span<const Candidate> hidden, const Vec3& point, const Vec3& normal,
                             std::uint32_t count, std::uint64_t seed, DirectView& view, std::uint64_t& rays) const {
  // All parts in a row, each as long as the light it could bring; places at equal steps along the row.
  struct Piece {
    Aim aim;
    const Luminaire* luminaire;
    double end;
  };
  std::vector<Piece> row;
  double length = 0;
  for (const Candidate& c : hidden) {
    const Luminaire& luminaire = luminaires_[c.luminaire];
    const double behind = -glm::dot(luminaire.normal, luminaire.centre - point), before = length;
    const std::size_t pieces = row.size();
    bool is_wide = false;
    for_each_aim(c, level_for(c, 1.0, {count, 64, {}}), point, normal, [&](const Aim& aim) {
      const double far = std::max(behind, glm::length(aim.part->centre - point) - aim.part->radius);
      is_wide = is_wide || aim.part->radius > widest_part * far;
      row.push_back({aim, &luminaire, length += aim.weight * sum_channels(luminaire.radiance)});
    });
    view.shared.push_back({luminaire.surface, is_wide ? 0.0 : sum_channels(luminaire.radiance)});
    if (is_wide) row.resize(pieces), length = before;
  }
  for (DirectView::Shared& one : view.shared) one.density *= length > 0 ? count / length : 0.0;
  std::sort(view.shared.begin(), view.shared.end(),
            [](const DirectView::Shared& a, const DirectView::Shared& b) { return a.surface < b.surface; });
  if (row.empty()) return;

  const double lift = scene_->offset();
  const Vec3 from = point + lift * normal;
  ShadowRays shadow(*scene_, from);
  Random random(seed, 7);
  std::vector<double> got(count, 0.0);
  std::size_t piece = 0;
  for (std::uint32_t k = 0; k < count; ++k) {
    const double place = (k + random.unit()) / count * length;
    while (piece + 1 < row.size() && row[piece].end <= place) ++piece;
    const auto& [aim, luminaire, end] = row[piece];
    const Vec3 target =
        shining_place(corners(*aim.part), aim.part->area, luminaire->normal, point, normal, aim.target, random) +
        lift * luminaire->normal;
    view.samples.push_back({glm::normalize(target - from), std::numbers::pi * luminaire->radiance,
                            count * sum_channels(luminaire->radiance) / length});
    shadow.add(target, got[k]);
  }
  shadow.flush();
  rays += shadow.count();
  for (std::uint32_t k = 0; k < count; ++k) view.samples[k].light *= got[k];
}

std::optional<double> DirectView::density(std::uint32_t surface) const {
  const auto found = std::lower_bound(shared.begin(), shared.end(), surface,
                                      [](const Shared& one, std::uint32_t s) { return one.surface < s; });
  if (found == shared.end() || found->surface != surface) return std::nullopt;
  return found->density;
}

DirectLight::Sample DirectLight::sample(Random& random) const {
  MUST(!luminaires_.empty());
  const double pick = random.unit() * cumulative_.back();
  const auto found = std::upper_bound(cumulative_.begin(), cumulative_.end(), pick) - cumulative_.begin();
  const auto index = std::min(static_cast<std::size_t>(found), luminaires_.size() - 1);
  const Luminaire& luminaire = luminaires_[index];
  const Part& whole = parts_[luminaire.first_part[0]];
  return {random_place(corners(whole), whole.area, random), luminaire.normal, luminaire.radiance,
          density_of_surface_[luminaire.surface]};
}

}  // namespace lichthof
