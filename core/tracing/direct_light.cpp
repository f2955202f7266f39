#include "core/tracing/direct_light.hpp"

#include <algorithm>
#include <cmath>
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
/// More parts than this in all, and luminaires get fewer levels.
constexpr std::size_t part_budget = 400000;

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

  /// @param got, total  visible and whole weight that this ray's share is added to
  void add(const Vec3& target, double weight, double& got) {
    const Vec3 way = target - origin_;
    segments_.dx[used_] = static_cast<float>(way.x);
    segments_.dy[used_] = static_cast<float>(way.y);
    segments_.dz[used_] = static_cast<float>(way.z);
    targets_[used_] = target;
    weights_[used_] = weight;
    got_[used_] = &got;
    if (++used_ == 16) flush();
  }

  void flush() {
    if (used_ == 0) return;
    const std::uint32_t active = used_ == 16 ? 0xffffu : (1u << used_) - 1;
    const std::uint32_t blocked = scene_.clear_rays().occluded16(segments_, active);
    for (std::uint32_t lane = 0; lane < used_; ++lane) {
      if ((blocked >> lane) & 1) continue;
      *got_[lane] += weights_[lane] * scene_.transmittance(origin_, targets_[lane]);
    }
    count_ += used_;
    used_ = 0;
  }
  std::uint64_t count() const { return count_; }

 private:
  const TraceScene& scene_;
  Vec3 origin_;
  Segments16 segments_;
  std::array<Vec3, 16> targets_;
  std::array<double, 16> weights_;
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
  out.weight = out.stands_for = sum_channels(luminaire.radiance) * out.form_factor;
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
                         Random& random) {
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
    bundled.push_back(candidates[chosen]);
    bundled.back().stands_for = weight;
  }
  candidates = std::move(bundled);
}

Rgb DirectLight::irradiance(const Vec3& point, const Vec3& normal, const DirectOptions& options,
                            std::uint64_t& rays) const {
  Rgb through_mirrors{0.0};
  if (options.rays_per_image > 0 && !images_.empty())
    through_mirrors = images_.irradiance(point, normal, options.rays_per_image, options.seed.value_or(1), rays);
  // Which luminaires could matter, strongest first.
  std::vector<Candidate> candidates;
  double total = 0;
  for (std::uint32_t i = 0; i < luminaires_.size(); ++i)
    if (Candidate c; candidate(i, point, normal, c)) {
      candidates.push_back(c);
      total += c.weight;
    }
  if (!(total > 0)) return through_mirrors;
  Random random(options.seed.value_or(0), 7);
  if (2 * candidates.size() > options.rays) bundle(candidates, total, options, random);
  if (candidates.size() > 1)
    std::sort(candidates.begin(), candidates.end(), [](const Candidate& a, const Candidate& b) {
      return a.stands_for != b.stands_for ? a.stands_for > b.stands_for : a.luminaire < b.luminaire;
    });

  // Visible and whole weight of each, over its parts.
  std::size_t traced = 0;
  for (double rest = total; traced < candidates.size() && rest > unimportant_share * total; ++traced)
    rest -= candidates[traced].stands_for;
  traced = std::max<std::size_t>(traced, 1);
  struct Seen {
    double visible = 0, whole = 0;
  };
  std::vector<Seen> seen(traced);
  const double lift = scene_->offset();
  ShadowRays shadow(*scene_, point + lift * normal);
  for (std::size_t i = 0; i < traced; ++i) {
    const Candidate& c = candidates[i];
    const Luminaire& luminaire = luminaires_[c.luminaire];
    const auto level = static_cast<std::size_t>(level_for(c, c.stands_for / total, options));
    const Vec3 target_lift = lift * luminaire.normal;
    for (std::uint32_t k = luminaire.first_part[level]; k < luminaire.first_part[level + 1]; ++k) {
      const Part& part = parts_[k];
      const Vec3 way = part.centre - point;
      const double d2 = glm::dot(way, way), height = glm::dot(normal, way);
      Vec3 target = part.centre;
      double weight;
      if (c.straddles && height < part.radius) {
        weight = form_factor(point, normal, corners(part));
        if (!(weight > 0) || !visible_point(point, normal, corners(part), target)) continue;
      } else {
        weight = d2 < near_part * near_part * part.radius * part.radius
                     ? form_factor(point, normal, corners(part))
                     : height * -glm::dot(luminaire.normal, way) * part.area / (std::numbers::pi * d2 * d2);
        if (!(weight > 0)) continue;
      }
      if (options.seed)
        target = shining_place(corners(part), part.area, luminaire.normal, point, normal, target, random);
      seen[i].whole += weight;
      shadow.add(target + target_lift, weight, seen[i].visible);
    }
  }
  shadow.flush();
  rays += shadow.count();

  // The unimportant ones are as visible as the others on average.
  Rgb sum{0.0};
  double got = 0, could = 0;
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    const Candidate& c = candidates[i];
    double visibility;
    if (i < traced) {
      visibility = seen[i].whole > 0 ? seen[i].visible / seen[i].whole : 0.0;
      got += visibility * c.stands_for, could += c.stands_for;
    } else {
      visibility = could > 0 ? got / could : 0.0;
    }
    sum +=
        std::numbers::pi * c.form_factor * (c.stands_for / c.weight) * visibility * luminaires_[c.luminaire].radiance;
  }
  return sum + through_mirrors;
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
