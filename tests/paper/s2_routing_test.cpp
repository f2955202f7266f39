// Where hemicube bitmaps travel: visible zone (Fig. 1), order of projection (Fig. 3), joins (Fig. 4), against brute force.
#include <doctest/doctest.h>

#include <algorithm>
#include <map>
#include <optional>
#include <set>

#include "core/base/random.hpp"
#include "core/cell/routing.hpp"

using namespace lichthof;

namespace {

CellGrid unit_cells(const CellPosition& size) {
  std::array<std::vector<double>, 3> boundaries;
  for (int axis = 0; axis < 3; ++axis)
    for (std::uint32_t k = 1; k < size[axis]; ++k) boundaries[axis].push_back(k);
  return CellGrid(Box{Vec3{0.0}, Vec3{double(size[0]), double(size[1]), double(size[2])}}, boundaries);
}

ShooterPose shooter_at(const CellGrid& grid, const Vec3& centre, const Vec3& normal) {
  Shot shot;
  shot.id.cell = grid.cell_of(centre);
  shot.centre = centre;
  shot.plane.normal = glm::normalize(normal);
  return pose_of(grid, shot);
}

std::vector<CellId> listed(const CellList& list) { return {list.begin(), list.end()}; }

// ---- Brute force ------------------------------------------------------------------------------------------------------

struct Triangle {
  Vec3 a, b, c;
  CellId cell;
};

/// Distance along the ray, or none.
std::optional<double> hit(const Triangle& t, const Vec3& origin, const Vec3& direction) {
  const Vec3 e1 = t.b - t.a, e2 = t.c - t.a, p = glm::cross(direction, e2);
  const double det = glm::dot(e1, p);
  if (std::abs(det) < 1e-14) return std::nullopt;
  const Vec3 s = origin - t.a, q = glm::cross(s, e1);
  const double u = glm::dot(s, p) / det, v = glm::dot(direction, q) / det, distance = glm::dot(e2, q) / det;
  if (u < 0 || v < 0 || u + v > 1 || distance <= 0) return std::nullopt;
  return distance;
}

Vec3 random_vector(Random& random) { return {random.unit(), random.unit(), random.unit()}; }

/// Irregular cells, triangles strewn in them, a shooter somewhere.
struct RandomWorld {
  std::optional<CellGrid> grid;
  std::vector<std::vector<Triangle>> triangles;  // per cell
  Shot shot;

  RandomWorld(std::uint64_t seed, bool in_3d) {
    Random random(seed);
    std::array<std::vector<double>, 3> boundaries;
    Vec3 end{1.0};
    for (int axis = 0; axis < (in_3d ? 3 : 2); ++axis) {
      const std::uint32_t cells = 1 + random.below(in_3d ? 4 : 6);
      for (std::uint32_t k = 1; k < cells; ++k) boundaries[axis].push_back(end[axis]), end[axis] += 0.3 + random.unit();
    }
    grid.emplace(Box{Vec3{0.0}, end}, boundaries);
    triangles.resize(grid->cell_count());
    for (CellId cell{0}; cell.value < grid->cell_count(); ++cell.value) {
      const Box box = grid->box(cell);
      for (std::uint32_t k = random.below(4); k > 0; --k) {
        const auto corner = [&] { return box.lo + box.size() * random_vector(random); };
        triangles[cell.value].push_back({corner(), corner(), corner(), cell});
      }
    }
    shot.id.cell = CellId{random.below(grid->cell_count())};
    const Box home = grid->box(shot.id.cell);
    shot.centre = home.lo + home.size() * random_vector(random);
    shot.plane.normal = glm::normalize(random_vector(random) - 0.5);
    if (random.below(3) == 0) {  // a wall: along an axis, sometimes right on the side of its cell
      const int axis = static_cast<int>(random.below(3));
      const bool high = random.below(2);
      shot.plane.normal = Vec3{0.0};
      shot.plane.normal[axis] = high ? -1 : 1;
      if (random.below(2)) shot.centre[axis] = high ? home.hi[axis] : home.lo[axis];
    }
    complete_frame(shot.plane.normal, shot.plane.u, shot.plane.v);
  }
};

constexpr std::uint32_t resolution = 12;

/// For each pixel the cell that claimed it, when bitmaps are delivered in random order by the routing functions alone.
struct Routed {
  std::map<std::uint32_t, std::vector<CellId>> claims;
  std::set<CellId> visited;
  std::uint32_t messages = 0, most_joined = 0;
  bool all_were_expected = true;
};

Routed route(const RandomWorld& world, Random& random) {
  const CellGrid& grid = *world.grid;
  const ShooterPose pose = pose_of(grid, world.shot);
  const HemicubeFrame frame = world.shot.frame();
  struct Parcel {
    CellId from, to;
    HemicubeBitmap bitmap;
  };
  std::vector<Parcel> under_way;
  std::map<CellId, std::pair<CellList, HemicubeBitmap>> waiting;
  Routed result;
  const auto project_and_send = [&](CellId cell, HemicubeBitmap bitmap) {
    if (!result.visited.insert(cell).second) result.all_were_expected = false;
    for (std::uint32_t pixel = 0; pixel < pixel_count(resolution); ++pixel) {
      if (bitmap.covered(pixel)) continue;
      const Vec3 direction = frame.to_world(pixel_direction(pixel, resolution));
      for (const Triangle& triangle : world.triangles[cell.value])
        if (hit(triangle, world.shot.centre, direction)) {
          bitmap.cover(pixel);
          result.claims[pixel].push_back(cell);
          break;
        }
    }
    for (const CellId next : successors(grid, pose, cell)) under_way.push_back({cell, next, bitmap});
  };
  project_and_send(pose.cell, HemicubeBitmap(resolution));
  while (!under_way.empty()) {
    std::swap(under_way[random.below(static_cast<std::uint32_t>(under_way.size()))], under_way.back());
    const Parcel parcel = under_way.back();
    under_way.pop_back();
    ++result.messages;
    const CellList expected = predecessors(grid, pose, parcel.to);
    auto& [from, joined] = waiting[parcel.to];
    if (!expected.contains(parcel.from) || from.contains(parcel.from)) result.all_were_expected = false;
    from.push_back(parcel.from);
    if (from.size() == 1)
      joined = parcel.bitmap;
    else
      joined.merge(parcel.bitmap);
    if (from.size() < expected.size()) continue;
    result.most_joined = std::max(result.most_joined, static_cast<std::uint32_t>(from.size()));
    project_and_send(parcel.to, joined);
    waiting.erase(parcel.to);
  }
  if (!waiting.empty()) result.all_were_expected = false;
  return result;
}

/// The cell whose triangle a pixel's ray meets first.
std::optional<CellId> nearest_cell(const RandomWorld& world, std::uint32_t pixel) {
  const Vec3 direction = world.shot.frame().to_world(pixel_direction(pixel, resolution));
  std::optional<CellId> nearest;
  double distance = 1e300;
  for (const auto& in_cell : world.triangles)
    for (const Triangle& triangle : in_cell)
      if (const auto d = hit(triangle, world.shot.centre, direction); d && *d < distance)
        distance = *d, nearest = triangle.cell;
  return nearest;
}

}  // namespace

TEST_SUITE("paper §2") {
  TEST_CASE("§2 Fig. 1: the visible zone is made of the cells that reach in front of the shooter's plane") {
    const CellGrid grid = unit_cells({4, 4, 1});
    // A patch in the second column that looks along +x and a little up.
    const ShooterPose shooter = shooter_at(grid, {1.5, 1.5, 0.5}, {1, 0.1, 0});

    const std::vector<CellId> zone = visible_zone(grid, shooter);

    for (CellId cell{0}; cell.value < 16; ++cell.value) {
      const Box box = grid.box(cell);
      bool a_corner_is_in_front = false;
      for (int corner = 0; corner < 8; ++corner) {
        const Vec3 p{corner & 1 ? box.hi.x : box.lo.x, corner & 2 ? box.hi.y : box.lo.y,
                     corner & 4 ? box.hi.z : box.lo.z};
        a_corner_is_in_front |= glm::dot(shooter.normal, p - shooter.centre) > 0;
      }
      CHECK((std::find(zone.begin(), zone.end(), cell) != zone.end()) == a_corner_is_in_front);
    }
    CHECK(zone.size() == 12);  // all but the column behind the shooter
  }

  TEST_CASE("§2 Fig. 1: a wall on a cell boundary shoots into its own side only") {
    const CellGrid grid = unit_cells({3, 1, 1});
    // Rounding of the mesher moves both the place and the normal a little.
    Shot shot;
    shot.id.cell = CellId{1};
    shot.centre = {1 - 1e-9, 0.5, 0.5};
    shot.plane.normal = glm::normalize(Vec3{1, 1e-9, -1e-9});
    CHECK(visible_zone(grid, pose_of(grid, shot)) == std::vector<CellId>{{1}, {2}});
    shot.centre.x = 1 + 1e-9;
    CHECK(visible_zone(grid, pose_of(grid, shot)) == std::vector<CellId>{{1}, {2}});
  }

  TEST_CASE("§2 Fig. 3: cell 3 sends to cells 1 and 4, and cell 2 waits for both") {
    // Cells as in the figure: 1 2 above 3 4.
    const CellGrid grid = unit_cells({2, 2, 1});
    const CellId cell_3{0}, cell_4{1}, cell_1{2}, cell_2{3};
    const ShooterPose shooter = shooter_at(grid, {0.3, 0.3, 0.5}, {1, 1, 0});

    CHECK(listed(successors(grid, shooter, cell_3)) == std::vector<CellId>{cell_4, cell_1});
    CHECK(listed(successors(grid, shooter, cell_1)) == std::vector<CellId>{cell_2});
    CHECK(listed(successors(grid, shooter, cell_4)) == std::vector<CellId>{cell_2});
    CHECK(listed(successors(grid, shooter, cell_2)).empty());

    CHECK(listed(predecessors(grid, shooter, cell_3)).empty());
    CHECK(listed(predecessors(grid, shooter, cell_1)) == std::vector<CellId>{cell_3});
    CHECK(listed(predecessors(grid, shooter, cell_4)) == std::vector<CellId>{cell_3});
    CHECK(listed(predecessors(grid, shooter, cell_2)) == std::vector<CellId>{cell_1, cell_4});
  }

  TEST_CASE("§2 Fig. 4: along the axes a bitmap runs straight, between them two meet in every cell") {
    const CellGrid grid = unit_cells({5, 5, 1});
    const ShooterPose shooter = shooter_at(grid, {2.5, 2.5, 0.5}, {0, 0, 1});  // sees the whole plane of cells

    CHECK(visible_zone(grid, shooter).size() == 25);
    for (CellId cell{0}; cell.value < 25; ++cell.value) {
      const CellPosition p = grid.position(cell);
      const std::size_t axes_away = (p[0] != 2) + (p[1] != 2);
      CHECK(predecessors(grid, shooter, cell).size() == axes_away);
      for (const CellId next : successors(grid, shooter, cell)) CHECK(predecessors(grid, shooter, next).contains(cell));
    }
    CHECK(successors(grid, shooter, grid.cell_of(shooter.centre)).size() == 4);
  }

  TEST_CASE("§2: what lies beyond a cell is everything its bitmap can still reach") {
    const CellGrid grid = unit_cells({4, 3, 1});
    const ShooterPose shooter = shooter_at(grid, {0.5, 1.5, 0.5}, {0, 0, 1});
    const Box after_neighbour = beyond(grid, shooter, grid.at({1, 1, 0}));
    CHECK(after_neighbour.lo == Vec3{1, 0, 0});
    CHECK(after_neighbour.hi == Vec3{4, 3, 1});
    const Box after_corner = beyond(grid, shooter, grid.at({2, 2, 0}));
    CHECK(after_corner.lo == Vec3{3, 2, 0});
    CHECK(after_corner.hi == Vec3{4, 3, 1});
    // Cells behind the shooter's plane do not widen it.
    const ShooterPose tilted = shooter_at(grid, {2.5, 1.5, 0.5}, {1, 0, 0});
    CHECK(reach(grid, tilted, grid.at({2, 2, 0})).lo.x == doctest::Approx(2));
  }

  TEST_CASE("§2: every pixel is claimed once, by the truly nearest cell, in whatever order messages arrive") {
    std::uint64_t messages = 0, visits = 0;
    for (std::uint64_t seed = 1; seed <= 400; ++seed) {
      const RandomWorld world(seed, seed % 2 == 0);
      Random order(seed * 7);
      const Routed routed = route(world, order);
      CAPTURE(seed);

      REQUIRE(routed.all_were_expected);
      const std::vector<CellId> zone = visible_zone(*world.grid, pose_of(*world.grid, world.shot));
      REQUIRE(std::equal(zone.begin(), zone.end(), routed.visited.begin(), routed.visited.end()));
      for (std::uint32_t pixel = 0; pixel < pixel_count(resolution); ++pixel) {
        const auto truth = nearest_cell(world, pixel);
        const auto claimed = routed.claims.find(pixel);
        REQUIRE((claimed != routed.claims.end()) == truth.has_value());
        if (!truth) continue;
        REQUIRE(claimed->second.size() == 1);
        REQUIRE(claimed->second[0] == *truth);
      }
      messages += routed.messages;
      visits += routed.visited.size() - 1;
    }
    CHECK(static_cast<double>(messages) < 2.0 * static_cast<double>(visits));
  }

  TEST_CASE("§2: at most 2 bitmaps join in 2-D and 3 in 3-D") {
    std::uint32_t most_in_2d = 0, most_in_3d = 0;
    for (std::uint64_t seed = 1000; seed < 1200; ++seed) {
      Random order(seed);
      const bool in_3d = seed % 2 == 0;
      std::uint32_t& most = in_3d ? most_in_3d : most_in_2d;
      most = std::max(most, route(RandomWorld(seed, in_3d), order).most_joined);
    }
    CHECK(most_in_2d == 2);
    CHECK(most_in_3d == 3);
  }
}
