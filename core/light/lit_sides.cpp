#include "core/light/lit_sides.hpp"

#include <algorithm>
#include <cmath>
#include <deque>
#include <numeric>
#include <optional>

#include "core/base/random.hpp"

namespace lichthof {

namespace {

/// Sets that are joined one pair at a time; find() with path halving.
class JoinedSets {
 public:
  explicit JoinedSets(std::size_t count) : parent_(count) { std::iota(parent_.begin(), parent_.end(), 0u); }
  std::uint32_t find(std::uint32_t i) {
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
    return i;
  }
  void join(std::uint32_t a, std::uint32_t b) { parent_[find(a)] = find(b); }

 private:
  std::vector<std::uint32_t> parent_;
};

/// Luminaires to aim at, by power.
struct Luminaires {
  std::vector<std::uint32_t> surfaces;
  std::vector<double> up_to;

  explicit Luminaires(const Scene& scene) {
    double total = 0;
    for (std::uint32_t s = 0; s < scene.surfaces.size(); ++s) {
      const Material& material = scene.material_of(scene.surfaces[s]);
      if (!material.emits()) continue;
      surfaces.push_back(s);
      up_to.push_back(total += sum_channels(material.radiance) * scene.surfaces[s].area);
    }
  }
  std::uint32_t pick(double unit) const {
    const auto found = std::upper_bound(up_to.begin(), up_to.end() - 1, unit * up_to.back());
    return surfaces[static_cast<std::size_t>(found - up_to.begin())];
  }
};

/// Where one leg of a walk lands.
struct Landing {
  std::uint32_t surface = 0;
  bool front = true;
  Vec3 point, normal;
};

/// A walk that leaves a side and is scattered wherever it lands.
class ProvingWalk {
 public:
  ProvingWalk(const Scene& scene, const RayScene& rays, const Luminaires& luminaires)
      : scene_(scene), rays_(rays), luminaires_(luminaires) {}

  /// Marks the fronts that a walk from a luminaire's front meets. @param proved  sides, 2s: front of surface s
  void mark_lit_fronts(Random& random, std::vector<std::uint8_t>& proved) const {
    const Surface& luminaire = scene_.surfaces[luminaires_.pick(random.unit())];
    Vec3 point = point_of(luminaire, {random.unit(), random.unit()}), normal = luminaire.normal;
    for (int step = 0; step < most_steps; ++step) {
      const std::optional<Landing> next = leg(point + rays_.offset() * normal, normal, random);
      if (!next) return;
      if (next->front) proved[2 * next->surface] = 1;
      point = next->point, normal = next->normal;
    }
  }

  /// Marks what light meets on from places where it is known to be. Each side is gone on from where it was met, and not from anywhere
  /// on it: of a floor what stands on it without a bottom sees places that are dark.
  /// @param lit_at  a place on each side that has proved lit, and the normal there
  void spread(std::deque<Landing> lit_at, std::vector<std::uint8_t>& proved) const {
    constexpr int legs = 16, most_visits = 4;
    constexpr std::size_t most_rays = 1 << 17;
    std::vector<std::uint8_t> visits(proved.size(), 0);
    Random random(0, 6);
    for (std::size_t rays = 0; !lit_at.empty() && rays < most_rays; rays += legs) {
      const Landing from = lit_at.front();
      lit_at.pop_front();
      for (int k = 0; k < legs; ++k) {
        const std::optional<Landing> next = leg(from.point + rays_.offset() * from.normal, from.normal, random);
        if (!next || scene_.material_of(scene_.surfaces[next->surface]).finish == Finish::glass) continue;
        const std::size_t side = 2 * next->surface + (next->front ? 0 : 1);
        proved[side] = 1;
        if (visits[side]++ < most_visits) lit_at.push_back(*next);
        visits[side] = std::min<std::uint8_t>(visits[side], most_visits);
      }
    }
  }

  /// @returns whether a point of the walk sees a luminaire's front
  bool reaches_light(Vec3 point, Vec3 normal, Random& random) const {
    for (int step = 0; step < most_steps; ++step) {
      const Vec3 from = point + rays_.offset() * normal;
      if (sees_light(from, normal, random)) return true;
      const std::optional<Landing> next = leg(from, normal, random);
      if (!next) return false;
      if (next->front && scene_.material_of(scene_.surfaces[next->surface]).emits()) return true;
      point = next->point, normal = next->normal;
    }
    return false;
  }

 private:
  static constexpr int most_steps = 6;

  std::optional<Landing> leg(const Vec3& from, const Vec3& normal, Random& random) const {
    Vec3 tangent, bitangent;
    complete_frame(normal, tangent, bitangent);
    const Vec3 local = cosine_direction({random.unit(), random.unit()});
    const Vec3 direction = local.x * tangent + local.y * bitangent + local.z * normal;
    const std::optional<Hit> hit = rays_.nearest(from, direction);
    if (!hit) return std::nullopt;
    const Surface& met = scene_.surfaces[hit->surface];
    return Landing{hit->surface, hit->front, from + hit->distance * direction, hit->front ? met.normal : -met.normal};
  }

  bool sees_light(const Vec3& from, const Vec3& normal, Random& random) const {
    const Surface& luminaire = scene_.surfaces[luminaires_.pick(random.unit())];
    const Vec3 to = point_of(luminaire, {random.unit(), random.unit()}) + rays_.offset() * luminaire.normal;
    return glm::dot(to - from, normal) > 0 && glm::dot(from - to, luminaire.normal) > 0 && !rays_.occluded(from, to);
  }

  const Scene& scene_;
  const RayScene& rays_;
  const Luminaires& luminaires_;
};

/// Sides that 32 rays per block, cosine-distributed, meet from one side: numbers 2s (front) and 2s + 1 (back).
std::vector<std::uint32_t> sides_seen_from(const Surface& surface, std::uint64_t seed, double blocks,
                                           const RayScene& rays) {
  constexpr double rays_per_block = 32;
  Vec3 tangent, bitangent;
  complete_frame(surface.normal, tangent, bitangent);
  const auto packets = static_cast<std::uint32_t>(std::ceil(blocks * rays_per_block / 16));
  Segments16 segments;
  clear_segments(segments);
  RayScene::Hits16 hits;
  Random random(seed, 2);
  std::vector<std::uint32_t> met;
  for (std::uint32_t packet = 0; packet < packets; ++packet) {
    for (int lane = 0; lane < 16; ++lane) {
      const Vec2 a{random.unit(), random.unit()}, b{random.unit(), random.unit()};
      const Vec3 from = point_of(surface, a) + rays.offset() * surface.normal - rays.origin();
      const Vec3 local = cosine_direction(b);
      const Vec3 direction = local.x * tangent + local.y * bitangent + local.z * surface.normal;
      segments.ox[lane] = static_cast<float>(from.x), segments.dx[lane] = static_cast<float>(direction.x);
      segments.oy[lane] = static_cast<float>(from.y), segments.dy[lane] = static_cast<float>(direction.y);
      segments.oz[lane] = static_cast<float>(from.z), segments.dz[lane] = static_cast<float>(direction.z);
    }
    rays.nearest16(segments, 0xffff, hits);
    for (int lane = 0; lane < 16; ++lane)
      if (hits.surface[lane] != RayScene::no_surface)
        met.push_back(2 * hits.surface[lane] + ((hits.front_bits >> lane) & 1 ? 0 : 1));
  }
  std::sort(met.begin(), met.end());
  met.erase(std::unique(met.begin(), met.end()), met.end());
  return met;
}

}  // namespace

std::vector<LitSides> lit_sides(const Scene& scene, const RayScene& rays, double block, const Parallel& parallel) {
  const std::size_t count = scene.surfaces.size();
  std::vector<LitSides> lit(count, {false, false});
  const Luminaires luminaires(scene);
  if (luminaires.surfaces.empty()) return lit;
  const auto blocks_of = [block](const Surface& surface, double most) {
    return std::clamp(surface.area / (block * block), 1.0, most);
  };

  std::vector<std::uint8_t> proved(2 * count, 0);
  std::vector<Landing> lit_at(2 * count);
  const ProvingWalk walk(scene, rays, luminaires);
  parallel.for_each(2 * count, [&](std::size_t side) {
    const Surface& surface = scene.surfaces[side / 2];
    if (scene.material_of(surface).finish == Finish::glass) return;
    const bool back = side % 2;
    if (!back && scene.material_of(surface).emits()) {
      proved[side] = 1;
      lit_at[side] = {static_cast<std::uint32_t>(side / 2), true, centroid(surface.corners), surface.normal};
      return;
    }
    constexpr double walks_per_block = 16;
    const auto walks = static_cast<std::uint32_t>(walks_per_block * blocks_of(surface, 16));
    Random random(side, 1);
    const Vec3 normal = back ? -surface.normal : surface.normal;
    for (std::uint32_t w = 0; w < walks && !proved[side]; ++w) {
      const Vec3 point = point_of(surface, {random.unit(), random.unit()});
      proved[side] = walk.reaches_light(point, normal, random);
      lit_at[side] = {static_cast<std::uint32_t>(side / 2), !back, point, normal};
    }
  });
  std::deque<Landing> places;
  for (std::size_t side = 0; side < 2 * count; ++side)
    if (proved[side]) places.push_back(lit_at[side]);
  walk.spread(std::move(places), proved);

  Random light(0, 5);
  constexpr int walks_of_light = 4096;
  for (int k = 0; k < walks_of_light; ++k) walk.mark_lit_fronts(light, proved);

  std::vector<std::vector<std::uint32_t>> seen(count);
  parallel.for_each(count, [&](std::size_t s) {
    const Surface& surface = scene.surfaces[s];
    if (!proved[2 * s] && scene.material_of(surface).finish != Finish::glass)
      seen[s] = sides_seen_from(surface, s, blocks_of(surface, 1024), rays);
  });
  JoinedSets sets(2 * count);
  for (std::uint32_t s = 0; s < count; ++s)
    for (const std::uint32_t other : seen[s])
      if (other % 2 == 0 || proved[other]) sets.join(2 * s, other);
  std::vector<std::uint8_t> has_light(2 * count, 0);
  for (std::uint32_t side = 0; side < 2 * count; ++side)
    if (proved[side]) has_light[sets.find(side)] = 1;
  for (std::uint32_t s = 0; s < count; ++s) {
    lit[s].front = has_light[sets.find(2 * s)];
    lit[s].back = proved[2 * s + 1];
  }
  return lit;
}

}  // namespace lichthof
