#include "core/light/group_exchange.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <numeric>

#include "core/base/random.hpp"
#include "core/light/group_rays.hpp"

namespace lichthof {

namespace {

constexpr double rays_in_all = 1 << 17;
constexpr double least_batches = 1, most_batches = 16;
/// Of each group to luminaires.
constexpr std::uint32_t shadow_rays = 64;

/// Which group holds a point of a surface side.
class GroupFinder {
 public:
  explicit GroupFinder(const Mesh& mesh) : mesh_(mesh) {
    std::size_t sides = 0;
    for (const Group& group : mesh.groups) sides = std::max(sides, side_of(group.surface.value, group.back) + 1);
    first_.assign(sides + 1, 0);
    for (const Group& group : mesh.groups) ++first_[side_of(group.surface.value, group.back) + 1];
    std::partial_sum(first_.begin(), first_.end(), first_.begin());
    groups_.resize(mesh.groups.size());
    std::vector<std::uint32_t> next(first_.begin(), first_.end() - 1);
    for (std::uint32_t g = 0; g < mesh.groups.size(); ++g)
      groups_[next[side_of(mesh.groups[g].surface.value, mesh.groups[g].back)]++] = g;
    // By their blocks, so that a few of many have to be looked at.
    for (std::size_t side = 0; side < sides; ++side)
      std::sort(groups_.begin() + first_[side], groups_.begin() + first_[side + 1],
                [&](std::uint32_t a, std::uint32_t b) { return mesh.groups[a].block < mesh.groups[b].block; });
  }

  static constexpr std::uint32_t none = ~0u;
  /// @returns none where the side has no group
  std::uint32_t at(std::uint32_t surface, bool back, const Vec3& point) const {
    const std::size_t side = side_of(surface, back);
    if (side + 1 >= first_.size() || first_[side] == first_[side + 1]) return none;
    const std::span<const std::uint32_t> groups{groups_.data() + first_[side], groups_.data() + first_[side + 1]};
    if (groups.size() == 1) return groups[0];
    const Vec2 at = mesh_.planes[mesh_.groups[groups[0]].plane.value].coordinates(point);
    std::uint32_t nearest = none;
    double least = 1e300;
    for (const std::uint32_t group : candidates(groups, point))
      if (const double outside = distance_outside(group, at); outside < least) least = outside, nearest = group;
    return nearest;
  }

 private:
  static std::size_t side_of(std::uint32_t surface, bool back) { return 2 * std::size_t{surface} + (back ? 1 : 0); }

  /// Those whose block along x is the point's, or a neighbour of it; all if there are none.
  std::span<const std::uint32_t> candidates(std::span<const std::uint32_t> groups, const Vec3& point) const {
    const std::vector<double>& lines = mesh_.lines[0];
    const auto column = std::upper_bound(lines.begin(), lines.end(), point.x) - lines.begin() - 1;
    const auto block = [&](std::uint32_t g) { return static_cast<std::ptrdiff_t>(mesh_.groups[g].block[0]); };
    const auto first =
        std::lower_bound(groups.begin(), groups.end(), column - 1, [&](auto g, auto x) { return block(g) < x; });
    const auto last = std::upper_bound(first, groups.end(), column + 1, [&](auto x, auto g) { return x < block(g); });
    return first == last ? groups : std::span<const std::uint32_t>(first, last);
  }

  /// How far a point lies beyond the edge it is furthest beyond (m); negative inside.
  double distance_outside(std::uint32_t group, const Vec2& at) const {
    const std::span<const Vec2> corners = mesh_.polygon(mesh_.groups[group].polygon);
    double furthest = -1e300;
    for (std::size_t k = 0; k < corners.size(); ++k) {
      const Vec2 edge = corners[(k + 1) % corners.size()] - corners[k], way = at - corners[k];
      const double length = glm::length(edge);
      if (length > 0) furthest = std::max(furthest, (edge.y * way.x - edge.x * way.y) / length);
    }
    return furthest;
  }

  const Mesh& mesh_;
  std::vector<std::uint32_t> first_, groups_;
};

struct Luminaire {
  std::uint32_t surface = 0;
  Vec3 centre{0.0}, normal{0.0};
  double area = 0, radiance = 0;  ///< m²; W/(m² sr), channels summed
};

std::vector<Luminaire> luminaires_of(const Scene& scene) {
  std::vector<Luminaire> luminaires;
  for (std::uint32_t s = 0; s < scene.surfaces.size(); ++s) {
    const Surface& surface = scene.surfaces[s];
    if (const Material& material = scene.material_of(surface); material.emits() && surface.area > 0)
      luminaires.push_back({s, centroid(std::span<const Vec3>(surface.corners)), surface.normal, surface.area,
                            sum_channels(material.radiance)});
  }
  return luminaires;
}

/// Direct light on one group by both ways of finding it, weighed by the balance heuristic [Veach95]: rays to luminaires, chosen
/// by what they could bring to it, and the rays it casts anyway.
class DirectEstimate {
 public:
  DirectEstimate(const Scene& scene, const Mesh& mesh, std::uint32_t group, std::span<const Luminaire> luminaires)
      : scene_(scene), group_(mesh.groups[group]), plane_(mesh.planes[group_.plane.value]),
        corners_(mesh.polygon(group_.polygon)), luminaires_(luminaires) {
    for (const Luminaire& luminaire : luminaires) {
      const double distance = std::max(0.0, glm::length(luminaire.centre - group_.centre) - group_.radius);
      const bool is_behind = glm::dot(luminaire.normal, group_.centre - luminaire.centre) < -group_.radius;
      chance_.push_back(is_behind ? 0.0
                                  : luminaire.radiance * std::min(1.0, luminaire.area / (std::numbers::pi * distance * distance)));
      total_ += chance_.back();
    }
  }

  /// Irradiance (W/m²), channels summed. @param cast  batches of the group's own rays
  double irradiance(std::span<const GroupRays> cast, const RayScene& rays, std::uint64_t seed) const {
    const double own = static_cast<double>(cast.size()) * GroupRays::count;
    double sum = 0;
    for (const GroupRays& batch : cast)
      for (std::uint32_t k = 0; k < GroupRays::count; ++k)
        if (batch.surface[k] != RayScene::no_surface && batch.front[k]) sum += by_chance(batch, k, own) / own;
    if (!(total_ > 0)) return sum;
    Random random(seed, 3);
    for (std::uint32_t k = 0; k < shadow_rays; ++k) sum += by_aim(rays, own, random) / shadow_rays;
    return sum;
  }

 private:
  double by_chance(const GroupRays& batch, std::uint32_t k, double own) const {
    const Surface& met = scene_.surfaces[batch.surface[k]];
    if (!scene_.material_of(met).emits()) return 0;
    const auto found = std::ranges::lower_bound(luminaires_, batch.surface[k], {}, &Luminaire::surface);
    if (found == luminaires_.end() || found->surface != batch.surface[k]) return 0;
    const double cosine_there = -glm::dot(batch.direction[k], met.normal);
    const double density = glm::dot(batch.direction[k], plane_.normal) / std::numbers::pi;
    const double aimed = density_of_aim(static_cast<std::size_t>(found - luminaires_.begin())) * batch.distance[k] *
                         batch.distance[k] / std::max(cosine_there, 1e-9);
    return std::numbers::pi * found->radiance * own * density / (own * density + shadow_rays * aimed);
  }

  double by_aim(const RayScene& rays, double own, Random& random) const {
    double pick = random.unit() * total_;
    std::size_t chosen = 0;
    while (chosen + 1 < chance_.size() && pick >= chance_[chosen]) pick -= chance_[chosen++];
    const Luminaire& luminaire = luminaires_[chosen];
    const Vec2 square{random.unit(), random.unit()};
    const Vec3 from = plane_.point(place_in(corners_, group_.area, square)) + rays.offset() * plane_.normal;
    const Vec3 to = random_place(scene_.surfaces[luminaire.surface].corners, luminaire.area, random) +
                    rays.offset() * luminaire.normal;
    const Vec3 way = to - from;
    const double square_distance = glm::dot(way, way), distance = std::sqrt(square_distance);
    const double cosine = glm::dot(way, plane_.normal) / distance, cosine_there = -glm::dot(way, luminaire.normal) / distance;
    if (!(cosine > 0) || !(cosine_there > 0) || rays.occluded(from, to)) return 0;
    const double aimed = density_of_aim(chosen) * square_distance / cosine_there, density = cosine / std::numbers::pi;
    if (!(aimed > 0)) return 0;
    return luminaire.radiance * cosine / aimed * shadow_rays * aimed / (own * density + shadow_rays * aimed);
  }

  /// Per area of the luminaire (1/m²).
  double density_of_aim(std::size_t luminaire) const {
    return total_ > 0 ? chance_[luminaire] / (total_ * luminaires_[luminaire].area) : 0;
  }

  const Scene& scene_;
  const Group& group_;
  const Plane& plane_;
  std::span<const Vec2> corners_;
  std::span<const Luminaire> luminaires_;
  std::vector<double> chance_;
  double total_ = 0;
};

/// What the rays of one group met.
struct Met {
  std::vector<std::pair<std::uint32_t, std::uint32_t>> groups;  ///< ascending, and how many rays
  double rays = 0, closed = 0;                                  ///< all, and those that met a lit group
  double direct_w = 0;
};

std::vector<Met> cast_all(const Scene& scene, const Mesh& mesh, const Parallel& parallel) {
  std::vector<Met> met(mesh.groups.size());
  const RayScene rays(scene, scene.surfaces, bounds(scene).centre(), Glass::clear);
  const GroupFinder finder(mesh);
  const std::vector<Luminaire> luminaires = luminaires_of(scene);
  const auto lit = static_cast<double>(std::ranges::count_if(mesh.group_is_lit, [](auto is) { return is != 0; }));
  const auto batches = static_cast<std::uint32_t>(
      std::clamp(std::round(rays_in_all / (GroupRays::count * std::max(lit, 1.0))), least_batches, most_batches));
  constexpr std::size_t groups_per_task = 8;
  parallel.for_each((mesh.groups.size() + groups_per_task - 1) / groups_per_task, [&](std::size_t task) {
    std::vector<GroupRays> cast(batches);
    std::vector<std::uint32_t> hits;
    const std::size_t end = std::min(mesh.groups.size(), (task + 1) * groups_per_task);
    for (std::size_t g = task * groups_per_task; g < end; ++g) {
      if (!mesh.group_is_lit[g]) continue;
      const auto group = static_cast<std::uint32_t>(g);
      hits.clear();
      for (std::uint32_t batch = 0; batch < batches; ++batch) {
        cast_from_group(mesh, group, batch, rays, cast[batch]);
        for (std::uint32_t k = 0; k < GroupRays::count; ++k) {
          if (cast[batch].surface[k] == RayScene::no_surface) continue;
          const std::uint32_t other =
              finder.at(cast[batch].surface[k], !cast[batch].front[k], cast[batch].meeting_point(k));
          if (other != GroupFinder::none && mesh.group_is_lit[other]) hits.push_back(other);
        }
      }
      Met& own = met[g];
      std::ranges::sort(hits);
      for (const std::uint32_t other : hits) {
        if (own.groups.empty() || own.groups.back().first != other) own.groups.push_back({other, 0});
        ++own.groups.back().second;
      }
      own.rays = batches * GroupRays::count, own.closed = static_cast<double>(hits.size());
      own.direct_w = mesh.groups[g].area * DirectEstimate(scene, mesh, group, luminaires).irradiance(cast, rays, group);
    }
  });
  return met;
}

/// Sweeps over unknowns that depend on each other, each at once with what is known of the others [Gauss-Seidel], until none changes by
/// more than a hundredth of itself; what goes round in rooms without end is cut off. @param next  unknown g → its new value
template <class Next>
void sweep(std::vector<double>& values, Next&& next) {
  constexpr int most_sweeps = 100;
  constexpr double settled = 0.01;
  for (int i = 0; i < most_sweeps; ++i) {
    double change = 0;
    for (std::size_t g = 0; g < values.size(); ++g) {
      const double value = next(g);
      change = std::max(change, std::abs(value - values[g]) / std::max(std::abs(value), 1e-300));
      values[g] = value;
    }
    if (change < settled) return;
  }
}

}  // namespace

GroupExchange::GroupExchange(const Scene& scene, const Mesh& mesh, const Parallel& parallel) {
  measure(scene, mesh, parallel);
}

void GroupExchange::measure(const Scene& scene, const Mesh& mesh, const Parallel& parallel) {
  const std::size_t count = mesh.groups.size();
  const std::vector<Met> met = cast_all(scene, mesh, parallel);
  // X from the rays of both: as many as met the other, over the rays per area that both sent.
  std::vector<std::vector<Link>> links(count);
  const auto density = [&](std::size_t g) { return met[g].rays / mesh.groups[g].area; };
  for (std::uint32_t g = 0; g < count; ++g)
    for (const auto& [other, rays] : met[g].groups) {
      if (other == g) continue;  // rounding: it is flat
      const auto area = static_cast<float>(rays / (density(g) + density(other)));
      links[g].push_back({other, area});
      links[other].push_back({g, area});
    }
  std::vector<double> direct_w(count, 0.0), closed_area(count, 0.0);
  first_link_.assign(1, 0);
  for (std::uint32_t g = 0; g < count; ++g) {
    std::ranges::sort(links[g], {}, &Link::group);
    for (const Link& link : links[g]) {
      if (links_.size() > first_link_[g] && links_.back().group == link.group)
        links_.back().area += link.area;
      else
        links_.push_back(link);
    }
    first_link_.push_back(static_cast<std::uint32_t>(links_.size()));
    direct_w[g] = met[g].direct_w;
    if (met[g].rays > 0) closed_area[g] = mesh.groups[g].area * met[g].closed / met[g].rays;
  }
  // What a group sends arrives: its rays have told how much of it, better than the sum of what it exchanges with each.
  std::vector<double> scale(count, 1.0);
  constexpr int rounds = 4;
  for (int round = 0; round < rounds; ++round) {
    std::vector<double> next = scale;
    for (std::uint32_t g = 0; g < count; ++g) {
      double sum = 0;
      for (const Link& link : this->links(g)) sum += scale[link.group] * static_cast<double>(link.area);
      if (sum > 0) next[g] = std::sqrt(scale[g] * closed_area[g] / sum);
    }
    scale.swap(next);
  }
  for (std::uint32_t g = 0; g < count; ++g)
    for (std::uint32_t k = first_link_[g]; k < first_link_[g + 1]; ++k)
      links_[k].area *= static_cast<float>(scale[g] * scale[links_[k].group]);
  forecast(mesh, direct_w);
}

void GroupExchange::forecast(const Mesh& mesh, std::span<const double> direct_w) {
  const std::size_t count = mesh.groups.size();
  std::vector<double> reflectance(count, 0.0), emitted_w(count, 0.0);
  for (std::size_t g = 0; g < count; ++g) {
    const Group& group = mesh.groups[g];
    for (std::uint32_t p = group.first_patch; p < group.first_patch + group.patch_count; ++p) {
      const Patch& patch = mesh.patches[p];
      reflectance[g] += patch.area / group.area * sum_channels(patch.reflectance) / 3;
      emitted_w[g] += patch.area * sum_channels(patch.exitance);
    }
    reflectance[g] = std::min(reflectance[g], 0.999);  // nothing built is whiter
  }
  std::vector<double> power_w(direct_w.begin(), direct_w.end());
  sweep(power_w, [&](std::size_t g) {
    double sum = direct_w[g];
    for (const Link& link : links(static_cast<std::uint32_t>(g)))
      sum += static_cast<double>(link.area) * reflectance[link.group] * power_w[link.group] / mesh.groups[link.group].area;
    return sum;
  });

  // What is a millionth of what is usual where the light is counts for nothing.
  constexpr double least_of_usual = 1e-6;
  double squares = 0, all = 0;
  for (std::size_t g = 0; g < count; ++g) squares += power_w[g] * power_w[g] / mesh.groups[g].area, all += power_w[g];
  const double floor = all > 0 ? least_of_usual * squares / all : 0;

  irradiance_.resize(count), radiosity_.resize(count), weight_.assign(count, 1.0);
  std::vector<double> gain(count, 0.0), importance(count, 0.0);  // 1/W
  for (std::uint32_t g = 0; g < count; ++g) {
    const double area = mesh.groups[g].area;
    irradiance_[g] = power_w[g] / area;
    radiosity_[g] = reflectance[g] * irradiance_[g] + emitted_w[g] / area;
    // A group's region: an area as large as if all of it shared alike what the group sends, and lit as the group is.
    double per_area = 0;
    for (const Link& link : links(g)) per_area += std::pow(static_cast<double>(link.area) / area, 2) / mesh.groups[link.group].area;
    // Where no ray has found any, light is none that could be told from what leaks.
    if (irradiance_[g] > 0) gain[g] = per_area / std::max(irradiance_[g], floor);
  }
  sweep(importance, [&](std::size_t g) {
    double sum = 0;
    for (const Link& link : links(static_cast<std::uint32_t>(g)))
      sum += static_cast<double>(link.area) * (gain[link.group] + reflectance[link.group] * importance[link.group]);
    return sum / mesh.groups[g].area;
  });
  std::vector<std::uint32_t> all_groups(count);
  std::iota(all_groups.begin(), all_groups.end(), 0u);
  // Groups exchange most with few that are near and of other light than most of the room: where the light is this comes to 2 to 5.
  constexpr double unevenness = 3;
  const double strongest_w = power_of_strongest_luminaire(mesh, all_groups);
  for (std::size_t g = 0; g < count; ++g) weight_[g] = std::max(1.0, strongest_w * importance[g] / unevenness);
}

double power_of_strongest_luminaire(const Mesh& mesh, std::span<const std::uint32_t> groups) {
  constexpr double facet = 1.0 / 16;  // of a patch's area at most
  constexpr double most_facets = 200;
  std::map<std::array<std::uint16_t, 3>, double> facets;
  double largest = 0, largest_facet = 0;
  for (const std::uint32_t g : groups) {
    const Group& group = mesh.groups[g];
    double power = 0;
    for (std::uint32_t p = group.first_patch; p < group.first_patch + group.patch_count; ++p)
      power += sum_channels(mesh.patches[p].exitance) * mesh.patches[p].area;
    largest = std::max(largest, power);
    if (!(power > 0) || group.area > facet * mesh.options.patch_size * mesh.options.patch_size) continue;
    largest_facet = std::max(largest_facet, power);
    facets[group.block] += power;
  }
  for (const auto& [block, power] : facets) largest = std::max(largest, std::min(power, most_facets * largest_facet));
  return largest;
}

}  // namespace lichthof
