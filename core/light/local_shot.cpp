#include "core/light/local_shot.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/base/random.hpp"
#include "core/light/near_field.hpp"

namespace lichthof {

namespace {

std::vector<Vec3> world_corners(const Plane& plane, std::span<const Vec2> corners) {
  std::vector<Vec3> world;
  world.reserve(corners.size());
  for (const Vec2& c : corners) world.push_back(plane.point(c));
  return world;
}

/// An element as shadow rays see it, in the local frame.
struct AimedPlace {
  Vec3 middle;
  Vec3 across, along;  ///< edges (m); none where it is not a rectangle
  float area;          ///< m²
  float openness;      ///< in [0, 1]
  Rgbf reflected;      ///< W/m²
};

/// Sets of 16 places of a source. Receivers behind a slit see a little of it each, and together all of it evenly.
constexpr int aim_sets = 16;

/// 16 places, one from each of 16 strata, somewhere on the element that is met there: middles alone would fall into step with slits and
/// slats. Most rays aim where it is open, for from under furniture comes little light; some do everywhere, so that no place weighs more
/// than ten of those [Hesterberg95].
Aims aims_of_set(std::span<const AimedPlace> places, int set) {
  constexpr float open_share = 0.9f;
  float area = 0, open_area = 0;
  for (const AimedPlace& place : places) area += place.area, open_area += place.area * place.openness;
  const float per_openness = open_area > 0 ? open_share * area / open_area : 0;
  const auto density = [&](const AimedPlace& place) {
    return open_area > 0 ? per_openness * place.openness + (1 - open_share) : 1.f;
  };
  Aims aims;
  std::size_t next = 0;
  float up_to = places[0].area * density(places[0]);
  for (int stratum = 0; stratum < 16; ++stratum) {
    const float within = (static_cast<float>((set + stratum) % aim_sets) + 0.5f) / aim_sets;
    const float wanted = (static_cast<float>(stratum) + within) / 16.f * area;
    while (up_to < wanted && next + 1 < places.size()) ++next, up_to += places[next].area * density(places[next]);
    const AimedPlace& place = places[next];
    // Neighbouring lanes take strata far apart: stratum = 5 lane, mod 16.
    const int lane = stratum * 13 & 15;
    const Vec2 spot = r2_point(static_cast<std::uint32_t>(16 * set + stratum), Vec2{0.0}) - 0.5;
    const Vec3 aim = place.middle + spot.x * place.across + spot.y * place.along;
    for (const int l : {lane, lane + 16}) {
      aims.place.x[l] = static_cast<float>(aim.x);
      aims.place.y[l] = static_cast<float>(aim.y);
      aims.place.z[l] = static_cast<float>(aim.z);
      aims.weight[l] = 1 / density(place);
      for (int c = 0; c < 3; ++c) aims.reflected[c][l] = place.reflected[c];
    }
  }
  return aims;
}

FlatSource source_of(const Plane& plane, std::span<const Vec2> corners, const Vec3& origin, const Rgbf& reflected,
                     const Rgbf& emitted) {
  FlatSource source;
  source.flat = flat_shooter(world_corners(plane, corners), plane.normal, origin);
  source.box = box_of(source.flat);
  for (int c = 0; c < 3; ++c) source.reflected[c] = reflected[c], source.emitted[c] = emitted[c];
  const FlatShooter& f = source.flat;
  for (int k = 0; k < f.count; ++k) {
    const float x = f.x[k] - f.cx, y = f.y[k] - f.cy, z = f.z[k] - f.cz;
    source.radius = std::max(source.radius, std::sqrt(x * x + y * y + z * z));
  }
  return source;
}

/// Polygon of one grid place of a shooting patch; a rectangle where the patch is one.
void element_corners(const ShotPatch& patch, int column, int row, bool rectangular, Polygon2& corners) {
  const Vec2 step = (patch.hi - patch.lo) / Vec2{patch.columns, patch.rows};
  const Vec2 lo = patch.lo + step * Vec2{column, row}, hi = lo + step;
  corners = {lo, {hi.x, lo.y}, hi, {lo.x, hi.y}};
  if (rectangular) return;
  const double slack = 1e-9 * (step.x + step.y);
  Polygon2 piece = patch.corners;
  piece = clipped(piece, Vec2{1, 0}, lo.x, slack);
  if (!piece.empty()) piece = clipped(piece, Vec2{-1, 0}, -hi.x, slack);
  if (!piece.empty()) piece = clipped(piece, Vec2{0, 1}, lo.y, slack);
  if (!piece.empty()) piece = clipped(piece, Vec2{0, -1}, -hi.y, slack);
  corners = std::move(piece);
}

/// The convex polygon whose pieces have these corners, counter-clockwise.
/// @source [Andrew79]
Polygon2 hull_of(std::vector<Vec2> points) {
  std::sort(points.begin(), points.end(),
            [](const Vec2& a, const Vec2& b) { return std::pair(a.x, a.y) < std::pair(b.x, b.y); });
  Vec2 lo = points.front(), hi = lo;
  for (const Vec2& p : points) lo = glm::min(lo, p), hi = glm::max(hi, p);
  // Corners of the pieces that lie on an edge of the whole, to rounding, are none of its own.
  const double slack = 1e-9 * glm::dot(hi - lo, hi - lo);
  Polygon2 hull;
  const auto add_chain = [&](auto first, auto last) {
    const std::size_t start = hull.size();
    for (; first != last; ++first) {
      while (hull.size() >= start + 2) {
        const Vec2 a = hull.back() - hull[hull.size() - 2], b = *first - hull.back();
        if (a.x * b.y - a.y * b.x > slack) break;
        hull.pop_back();
      }
      hull.push_back(*first);
    }
    hull.pop_back();  // the other chain begins with it
  };
  add_chain(points.begin(), points.end());
  add_chain(points.rbegin(), points.rend());
  return hull;
}

class PartsOfShot {
 public:
  PartsOfShot(const Shot& shot, const Vec3& origin, LocalShot& local) : shot_(shot), origin_(origin), local_(local) {
    add_branch(shot.corners, shot.patches, 0);
  }

 private:
  /// @param patches  those of the branch
  /// @param level  0: the group, 1: a quarter of it, 2: a quarter of that
  void add_branch(std::span<const Vec2> corners, std::span<const ShotPatch> patches, int level) {
    const std::size_t part = local_.parts.size(), first_place = places_.size();
    local_.parts.push_back({ShotPart::Level::branch, 0, false, mean_of(corners, patches)});
    while (level < 2 && count_of_next(patches, level) == patches.size()) ++level;  // it is not divided here
    for (std::size_t next = 0; next < patches.size();) {
      const std::size_t count = level < 2 ? count_of_next(patches.subspan(next), level) : 1;
      const std::span<const ShotPatch> quarter = patches.subspan(next, count);
      const Polygon2 hull = count > 1 ? hull_of(corners_of(quarter)) : Polygon2{};
      // A shot from a peer may consist of what is no whole: it is seen patch by patch.
      if (hull.size() >= 3 && hull.size() <= FlatPolygon::max_corners)
        add_branch(hull, quarter, level + 1);
      else
        for (const ShotPatch& patch : quarter) add_patch(patch);
      next += count;
    }
    finish(part, first_place);
  }

  /// How many of the patches, from the first on, lie in the same quarter.
  static std::size_t count_of_next(std::span<const ShotPatch> patches, int level) {
    const auto quarter = [&](const ShotPatch& patch) { return patch.branch >> (level == 0 ? 2 : 0); };
    std::size_t count = 1;
    while (count < patches.size() && quarter(patches[count]) == quarter(patches[0])) ++count;
    return count;
  }

  static std::vector<Vec2> corners_of(std::span<const ShotPatch> patches) {
    std::vector<Vec2> corners;
    for (const ShotPatch& patch : patches) corners.insert(corners.end(), patch.corners.begin(), patch.corners.end());
    return corners;
  }

  FlatSource mean_of(std::span<const Vec2> corners, std::span<const ShotPatch> patches) const {
    Rgbf reflected{0.f}, emitted{0.f};
    float total_area = 0;
    for (const ShotPatch& patch : patches) {
      float area = 0;
      for (const float a : patch.area) area += a;
      reflected += area * patch.reflected;
      emitted += area * patch.emitted;
      total_area += area;
    }
    // A shot from a peer may have none: nothing leaves it then.
    if (!(total_area > 0)) total_area = 1;
    return source_of(shot_.plane, corners, origin_, reflected / total_area, emitted / total_area);
  }

  void add_patch(const ShotPatch& patch) {
    // A shot from a peer may have patches of no area, whatever it says that leaves them.
    if (std::none_of(patch.area.begin(), patch.area.end(), [](float area) { return area > 0; })) return;
    const std::size_t part = local_.parts.size(), first_place = places_.size();
    local_.emits |= patch.emitted != Rgbf{0.f};
    local_.parts.push_back({ShotPart::Level::patch, 0, false,
                            source_of(shot_.plane, patch.corners, origin_, patch.reflected, patch.emitted)});
    const Vec2 size = patch.hi - patch.lo;
    const bool rectangular =
        patch.corners.size() == 4 && std::abs(signed_area(patch.corners) - size.x * size.y) <= 1e-9 * size.x * size.y;
    for (int row = 0; row < patch.rows; ++row)
      for (int column = 0; column < patch.columns; ++column) {
        const std::size_t place = static_cast<std::size_t>(row) * patch.columns + static_cast<std::size_t>(column);
        if (patch.area[place] <= 0) continue;
        element_corners(patch, column, row, rectangular, corners_);
        if (corners_.size() < 3) continue;
        local_.reflects |= patch.delta[place] != patch.emitted;
        const auto end = static_cast<std::uint32_t>(local_.parts.size()) + 1;
        local_.parts.push_back(
            {ShotPart::Level::element, end, false,
             source_of(shot_.plane, corners_, origin_, patch.delta[place] - patch.emitted, patch.emitted)});
        const FlatShooter& f = local_.parts.back().source.flat;
        const auto edge = [&](const Vec2& from, const Vec2& to) {
          return corners_.size() == 4 && rectangular ? shot_.plane.point(to) - shot_.plane.point(from) : Vec3{0.0};
        };
        places_.push_back({Vec3{f.cx, f.cy, f.cz}, edge(corners_[0], corners_[1]), edge(corners_[1], corners_[2]),
                           patch.area[place], patch.openness[place], patch.delta[place] - patch.emitted});
        set_aims(local_.parts.back().source, std::span(places_).last(1), 1);
      }
    finish(part, first_place);
  }

  void finish(std::size_t part, std::size_t first_place) {
    local_.parts[part].end = static_cast<std::uint32_t>(local_.parts.size());
    const std::span<const AimedPlace> places = std::span(places_).subspan(first_place);
    const auto veiled =
        std::count_if(places.begin(), places.end(), [](const AimedPlace& p) { return p.openness <= 0; });
    local_.parts[part].is_mixed = veiled > 0 && veiled < std::ssize(places);
    if (veiled > 0 && local_.parts[part].level == ShotPart::Level::patch)
      for (std::size_t e = part + 1; e < local_.parts[part].end; ++e)
        local_.aims[local_.parts[e].source.first_aims].place = places_over(local_.parts[e].source.flat);
    // A shot from a peer may have none.
    const FlatShooter& f = local_.parts[part].source.flat;
    const AimedPlace middle{Vec3{f.cx, f.cy, f.cz}, Vec3{0.0}, Vec3{0.0}, 1.f, 1.f, Rgbf{0.f}};
    set_aims(local_.parts[part].source, places.empty() ? std::span(&middle, 1) : places,
             places.size() > 16 ? aim_sets : 1);
  }

  void set_aims(FlatSource& source, std::span<const AimedPlace> places, int sets) {
    source.first_aims = static_cast<std::uint32_t>(local_.aims.size());
    source.aims_count = static_cast<std::uint32_t>(sets);
    for (int set = 0; set < sets; ++set) local_.aims.push_back(aims_of_set(places, set));
  }

  const Shot& shot_;
  const Vec3& origin_;
  LocalShot& local_;
  std::vector<AimedPlace> places_;  ///< of all elements so far
  Polygon2 corners_;
};

}  // namespace

LocalShot local_shot(const Shot& shot, const Vec3& origin) {
  LocalShot local;
  PartsOfShot(shot, origin, local);
  return local;
}

}  // namespace lichthof
