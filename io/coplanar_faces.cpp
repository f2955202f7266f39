#include "io/coplanar_faces.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <tuple>
#include <unordered_map>

#include "core/scene/polygon.hpp"

namespace lichthof::io {

namespace {

// Two faces lie in one plane when rays, lifted off one by 1e-6 of the scene's size, could start behind the other.
constexpr double same_plane_share = 2e-6;
// Sheets further apart than rays are lifted (RayScene::offset) hide each other and stay as they are.
constexpr double lift_share = 5e-7;
// Pieces reach this far under the face that stays, in sizes of the scene: more than the ray tracer's rounding, so that no ray
// slips through between them, and less than the mesher takes notice of.
constexpr double hair_share = 5e-8;
constexpr double rounding_share = 1e-9;
constexpr double least_overlap_share = 1e-4;      // of the smaller face: neighbours share an edge within rounding
constexpr std::uint64_t most_steps = 30'000'000;  // grid entries and box tests; some seconds

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

/// A pair of surfaces that overlap.
struct Pair {
  std::uint32_t face, other_face, surface, other_surface;
  auto operator<=>(const Pair&) const = default;
};

/// In the order of the faces, so that what follows does not depend on the hash; each pair of surfaces once.
std::vector<Pair> overlapping(const Scene& scene, const Box& box, bool& complete) {
  const double same_plane_m = same_plane_share * glm::length(box.size());
  std::uint64_t budget = most_steps;
  std::vector<Pair> pairs;
  const auto found = [&](std::uint32_t a, std::uint32_t b) {
    if (scene.surfaces[a].source_face > scene.surfaces[b].source_face) std::swap(a, b);
    pairs.push_back({scene.surfaces[a].source_face, scene.surfaces[b].source_face, a, b});
  };
  for (auto& [key, members] : buckets_of(scene, box, 16 * same_plane_m)) {
    if (members.size() < 2) continue;
    if (!PlaneSurvey(scene, std::move(members), same_plane_m).search(budget, found)) complete = false;
  }
  std::sort(pairs.begin(), pairs.end());
  pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
  return pairs;
}

/// Who stays whole before whom.
bool stays(const Scene& scene, std::uint32_t a, std::uint32_t b) {
  const auto rank = [&](std::uint32_t s) {
    return std::tuple(!scene.material_of(scene.surfaces[s]).emits(), scene.surfaces[s].area, s);
  };
  return rank(a) < rank(b);
}

void note_overlap(const Scene& scene, const FaceNames& names, const Surface& stays, const Surface& cut, bool was_cut,
                  ImportReport& report) {
  const bool luminaire = scene.material_of(stays).emits() && !scene.material_of(cut).emits();
  std::string line = names(stays) + (luminaire ? ": the luminaire" : ": the face") +
                     " lies in the plane of the one in " + names(cut) + " and overlaps it";
  if (was_cut)
    line += "; that one was cut out there";
  else
    line += ", closer than rays can tell: move it out by a millimetre";
  report.note(luminaire ? "luminaire in a face" : "overlapping faces", line);
}

/// Convex pieces of a convex polygon outside of another one in its plane, and a hair more.
void cut_out(const Polygon& whole, const Surface& cover, double size, std::vector<Polygon>& pieces) {
  const double hair = hair_share * size, rounding = rounding_share * size;
  const Vec3 origin = cover.corners[0];
  Polygon rest;
  for (const Vec3& corner : whole) rest.push_back(corner - origin);
  const auto keep = [&](Polygon piece) {
    for (Vec3& corner : piece) corner += origin;
    pieces.push_back(std::move(piece));
  };
  for (std::size_t k = 0; k < cover.corners.size() && !rest.empty(); ++k) {
    const Vec3 from = cover.corners[k] - origin,
               edge = cover.corners[(k + 1) % cover.corners.size()] - cover.corners[k];
    const double length = glm::length(edge);
    if (length <= rounding) continue;
    const Vec3 outwards = glm::cross(edge, cover.normal) / length;
    const double offset = glm::dot(outwards, from);
    // Only where the polygon reaches beyond the edge; else the hair alone would be left.
    if (!clipped(rest, outwards, offset, rounding).empty()) keep(clipped(rest, outwards, offset - hair, 0.0));
    rest = clipped(rest, -outwards, -offset, 0.0);
  }
}

bool within_lift(const Surface& a, const Surface& b, double lift) {
  return std::all_of(b.corners.begin(), b.corners.end(),
                     [&](const Vec3& corner) { return std::abs(glm::dot(corner - a.corners[0], a.normal)) <= lift; });
}

Surface piece_of(const Surface& whole, Polygon corners) {
  Surface piece = whole;
  piece.texcoords.clear();
  if (!whole.texcoords.empty())
    for (const Vec3& corner : corners) piece.texcoords.push_back(texcoord_at(whole, corner));
  piece.area = area(corners);
  piece.corners = std::move(corners);
  return piece;
}

/// A face that is to be cut.
struct Covered {
  std::vector<std::uint32_t> covers;
  std::vector<Polygon> left;
  bool whole = false;  ///< it stays, as the other side of what covers it
};

void cut(const Scene& scene, std::uint32_t face, double size, bool keep_backs, Covered& covered) {
  const Surface& surface = scene.surfaces[face];
  covered.left = {surface.corners};
  for (const std::uint32_t cover : covered.covers) {
    std::vector<Polygon> rest;
    for (const Polygon& piece : covered.left) cut_out(piece, scene.surfaces[cover], size, rest);
    covered.left = std::move(rest);
  }
  constexpr double nothing = 1e-5;  // of its area: the hairs that cuts leave
  double area_left = 0;
  for (const Polygon& piece : covered.left) area_left += area(piece);
  covered.whole = keep_backs && area_left < nothing * surface.area &&
                  std::all_of(covered.covers.begin(), covered.covers.end(), [&](std::uint32_t cover) {
                    return glm::dot(scene.surfaces[cover].normal, surface.normal) < 0;
                  });
  if (covered.whole) covered.left = {surface.corners};
}

}  // namespace

void cut_overlaps(Scene& scene, const FaceNames& names, ImportReport& report, bool keep_backs) {
  if (scene.surfaces.empty()) return;
  const Box box = bounds(scene);
  const double size = max_channel(box.size());
  std::vector<Pair> pairs = overlapping(scene, box, report.overlaps_complete);
  if (pairs.empty()) return;

  // Everyone is cut by the others as they were: what was taken from those is covered by somebody who stays before both.
  std::map<std::uint32_t, Covered> covered;
  for (Pair& pair : pairs) {
    const bool first_stays = stays(scene, pair.surface, pair.other_surface);
    if (!first_stays) std::swap(pair.surface, pair.other_surface);
    if (within_lift(scene.surfaces[pair.other_surface], scene.surfaces[pair.surface], lift_share * size))
      covered[pair.other_surface].covers.push_back(pair.surface);
  }
  for (auto& [face, what] : covered) cut(scene, face, size, keep_backs, what);

  for (std::size_t i = 0; i < pairs.size(); ++i) {
    // Pieces of one face count once.
    if (i > 0 && pairs[i].face == pairs[i - 1].face && pairs[i].other_face == pairs[i - 1].other_face) continue;
    const auto found = covered.find(pairs[i].other_surface);
    if (found != covered.end() && found->second.whole) continue;
    ++report.coplanar_overlaps;
    note_overlap(
        scene, names, scene.surfaces[pairs[i].surface], scene.surfaces[pairs[i].other_surface],
        within_lift(scene.surfaces[pairs[i].other_surface], scene.surfaces[pairs[i].surface], lift_share * size),
        report);
  }

  std::vector<Surface> left;
  left.reserve(scene.surfaces.size());
  for (std::uint32_t s = 0; s < scene.surfaces.size(); ++s) {
    const auto found = covered.find(s);
    if (found == covered.end()) {
      left.push_back(std::move(scene.surfaces[s]));
      continue;
    }
    for (Polygon& piece : found->second.left) left.push_back(piece_of(scene.surfaces[s], std::move(piece)));
  }
  scene.surfaces = std::move(left);
  report.surfaces_made = scene.surfaces.size();
}

}  // namespace lichthof::io
