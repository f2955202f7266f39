#include "io/scene_survey.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <unordered_map>

#include "core/scene/polygon.hpp"
#include "io/text.hpp"

namespace lichthof::io {

namespace {

constexpr double large_scene_m = 200;
constexpr double small_scene_m = 0.05;
constexpr double lumens_per_watt = 179;
// Two faces lie in one plane when rays, lifted off one by 1e-6 of the scene's size, could start behind the other.
constexpr double same_plane_share = 2e-6;
constexpr double least_overlap_share = 1e-4;      // of the smaller face: neighbours share an edge within rounding
constexpr std::uint64_t most_steps = 30'000'000;  // grid entries and box tests; some seconds

std::string shown(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.4g", value);
  return text;
}

std::uint64_t mixed(std::uint64_t hash, std::int64_t value) {
  hash = (hash ^ static_cast<std::uint64_t>(value)) * 0x9E3779B97F4A7C15ull;
  return hash ^ (hash >> 32);
}

/// Surfaces of (about) one plane, flattened to it.
class PlaneSurvey {
 public:
  PlaneSurvey(const Scene& scene, std::vector<std::uint32_t> members, double same_plane_m)
      : scene_(scene), members_(std::move(members)), same_plane_m_(same_plane_m) {}

  /// Calls found(a, b) for every overlapping pair, a < b. @returns false when `budget` ran out
  bool search(std::uint64_t& budget, const std::function<void(std::uint32_t, std::uint32_t)>& found);

 private:
  struct Flat {
    Polygon2 corners;
    Vec2 lo{1e300}, hi{-1e300};
  };
  void flatten();
  bool overlap(std::size_t a, std::size_t b) const;

  const Scene& scene_;
  std::vector<std::uint32_t> members_;
  double same_plane_m_;
  std::vector<Flat> flat_;
};

void PlaneSurvey::flatten() {
  const Surface& first = scene_.surfaces[members_[0]];
  const Vec3 n = first.normal, across = std::abs(n.x) < 0.6 ? Vec3{1, 0, 0} : Vec3{0, 1, 0};
  const Vec3 u = glm::normalize(glm::cross(across, n)), v = glm::cross(n, u);
  for (const std::uint32_t member : members_) {
    Flat flat;
    for (const Vec3& corner : scene_.surfaces[member].corners) {
      const Vec3 d = corner - first.corners[0];
      flat.corners.push_back({glm::dot(d, u), glm::dot(d, v)});
      flat.lo = glm::min(flat.lo, flat.corners.back()), flat.hi = glm::max(flat.hi, flat.corners.back());
    }
    if (signed_area(flat.corners) < 0) std::reverse(flat.corners.begin(), flat.corners.end());
    flat_.push_back(std::move(flat));
  }
}

bool PlaneSurvey::overlap(std::size_t a, std::size_t b) const {
  const Surface &first = scene_.surfaces[members_[a]], &second = scene_.surfaces[members_[b]];
  if (first.source_face == second.source_face) return false;
  for (const Vec3& corner : second.corners)
    if (std::abs(glm::dot(corner - first.corners[0], first.normal)) > same_plane_m_) return false;
  const double least = least_overlap_share * std::min(first.area, second.area);
  Polygon2 common = flat_[a].corners;
  const Polygon2& cutter = flat_[b].corners;
  for (std::size_t i = 0; i < cutter.size() && !common.empty(); ++i) {
    const Vec2 edge = cutter[(i + 1) % cutter.size()] - cutter[i];
    const double length = glm::length(edge);
    if (length == 0) continue;
    const Vec2 inwards = Vec2{-edge.y, edge.x} / length;
    common = clipped(common, inwards, glm::dot(inwards, cutter[i]), same_plane_m_);
  }
  return common.size() >= 3 && signed_area(common) > least;
}

bool PlaneSurvey::search(std::uint64_t& budget, const std::function<void(std::uint32_t, std::uint32_t)>& found) {
  flatten();
  // A grid with about one cell per surface, by the mean size of their boxes.
  Vec2 lo{1e300}, hi{-1e300}, mean{0.0};
  for (const Flat& flat : flat_) {
    lo = glm::min(lo, flat.lo), hi = glm::max(hi, flat.hi);
    mean += (flat.hi - flat.lo) / static_cast<double>(flat_.size());
  }
  const Vec2 cell = glm::max(mean, (hi - lo) / 1000.0) + Vec2{1e-30};
  std::unordered_map<std::uint64_t, std::vector<std::uint32_t>> grid;
  for (std::uint32_t i = 0; i < flat_.size(); ++i) {
    const Vec2 from = glm::floor((flat_[i].lo - lo) / cell), to = glm::floor((flat_[i].hi - lo) / cell);
    for (double y = from.y; y <= to.y; ++y) {
      for (double x = from.x; x <= to.x; ++x) {
        std::vector<std::uint32_t>& here = grid[static_cast<std::uint64_t>(y) << 32 | static_cast<std::uint64_t>(x)];
        for (const std::uint32_t other : here) {
          if (budget == 0) return false;
          --budget;
          // Where both boxes begin, at the latest, is the one cell that reports the pair.
          const Vec2 start = glm::max(flat_[i].lo, flat_[other].lo), end = glm::min(flat_[i].hi, flat_[other].hi);
          if (start.x > end.x || start.y > end.y || glm::floor((start - lo) / cell) != Vec2{x, y}) continue;
          const std::uint64_t price = 16 + flat_[i].corners.size() * flat_[other].corners.size();
          budget -= std::min(budget, price);
          if (overlap(other, i)) found(members_[other], members_[i]);
        }
        here.push_back(i);
        if (budget == 0) return false;
        --budget;
      }
    }
  }
  return true;
}

/// The planes as hash buckets. A plane near the border of a bucket goes into both, so that no pair is missed; a pair may
/// then be found twice.
std::unordered_map<std::uint64_t, std::vector<std::uint32_t>> buckets_of(const Scene& scene, const Box& box,
                                                                         double step) {
  constexpr double normal_step = 1e-3;
  std::unordered_map<std::uint64_t, std::vector<std::uint32_t>> buckets;
  for (std::uint32_t i = 0; i < scene.surfaces.size(); ++i) {
    const Surface& surface = scene.surfaces[i];
    Vec3 n = surface.normal;
    const Vec3 size = glm::abs(n);
    const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
    // Both sides of a plane are one plane here. The axis itself is no part of the key: two components tell the direction.
    if (n[axis] < 0) n = -n;
    const double offset = glm::dot(surface.corners[0] - box.centre(), n) / step;
    const double values[4] = {n.x / normal_step, n.y / normal_step, n.z / normal_step, offset};
    std::vector<std::uint64_t> keys{0};
    for (const double value : values) {
      const auto low = std::llround(value - 0.1), high = std::llround(value + 0.1);
      const std::size_t count = keys.size();
      for (std::size_t k = 0; k < count; ++k) {
        if (high != low) keys.push_back(mixed(keys[k], high));
        keys[k] = mixed(keys[k], low);
      }
    }
    for (const std::uint64_t key : keys) buckets[key].push_back(i);
  }
  return buckets;
}

void note_overlap(const Scene& scene, const FaceNames& names, std::uint32_t a, std::uint32_t b, ImportReport& report) {
  const Surface *small = &scene.surfaces[a], *large = &scene.surfaces[b];
  if (small->area > large->area) std::swap(small, large);
  const bool luminaire = scene.material_of(*small).emits() && !scene.material_of(*large).emits();
  if (luminaire)
    report.note("luminaire in a face", names(*small) + ": the luminaire lies in the plane of the larger face in " +
                                           names(*large) +
                                           ", which may hide it: move it out by a millimetre or cut a hole");
  else
    report.note("overlapping faces",
                names(*small) + ": the face lies in the plane of the one in " + names(*large) + " and overlaps it");
}

void survey_overlaps(const Scene& scene, const Box& box, const FaceNames& names, ImportReport& report) {
  const double size = glm::length(box.size());
  if (size == 0) return;
  const double same_plane_m = same_plane_share * size;
  std::uint64_t budget = most_steps;
  struct Pair {
    std::uint32_t face, other_face, surface, other_surface;
    auto operator<=>(const Pair&) const = default;
  };
  std::vector<Pair> pairs;
  const auto found = [&](std::uint32_t a, std::uint32_t b) {
    if (scene.surfaces[a].source_face > scene.surfaces[b].source_face) std::swap(a, b);
    pairs.push_back({scene.surfaces[a].source_face, scene.surfaces[b].source_face, a, b});
  };
  for (auto& [key, members] : buckets_of(scene, box, 16 * same_plane_m)) {
    if (members.size() < 2) continue;
    if (!PlaneSurvey(scene, std::move(members), same_plane_m).search(budget, found)) report.overlaps_complete = false;
  }
  // In the order of the faces, so that the report does not depend on the hash; pieces of one face count once.
  std::sort(pairs.begin(), pairs.end());
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    if (i > 0 && pairs[i].face == pairs[i - 1].face && pairs[i].other_face == pairs[i - 1].other_face) continue;
    ++report.coplanar_overlaps;
    note_overlap(scene, names, pairs[i].surface, pairs[i].other_surface, report);
  }
}

void survey_light(const Scene& scene, ImportReport& report) {
  std::vector<char> used(scene.materials.size(), 0);
  for (const Surface& surface : scene.surfaces) {
    const Material& material = scene.material_of(surface);
    used[surface.material] = 1;
    report.emitters += material.emits();
    report.power_w += std::numbers::pi * surface.area * material.radiance;
  }
  report.lumens = lumens_per_watt * luminance(report.power_w);
  report.materials = scene.materials.size();
  report.textures = scene.textures.size();
  for (std::size_t i = 0; i < used.size(); ++i)
    if (!used[i]) report.unused_materials.push_back(scene.materials[i].name);
}

}  // namespace

void survey(const Scene& scene, const FaceNames& names, ImportReport& report) {
  survey_light(scene, report);
  if (scene.surfaces.empty()) return;
  const Box box = bounds(scene);
  report.extent = box.size();
  const double largest = max_channel(report.extent);
  if (largest > large_scene_m)
    report.note("size", "the scene is " + shown(largest) + " m across: is its unit mm or cm? (--unit mm)");
  if (largest < small_scene_m)
    report.note("size", "the scene is only " + shown(largest) + " m across: is its unit m? (--unit m)");
  survey_overlaps(scene, box, names, report);
}

}  // namespace lichthof::io
