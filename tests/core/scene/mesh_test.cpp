#include "core/scene/mesh.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "tests/support/hemicube_reference.hpp"
#include "tests/support/rooms.hpp"
#include "tests/support/two_rooms.hpp"

using namespace lichthof;

namespace {

Mesh mesh_with(const Scene& scene, double patch_size, double element_size = 0) {
  MeshOptions options;
  options.patch_size = patch_size;
  options.element_size = element_size;
  return mesh_of(scene, options, {});
}

/// Triangles, oblique rectangles, an octagon and an L in convex pieces, in a room.
Scene mixed_scene() {
  Scene scene;
  const std::uint32_t grey = test::add_material(scene, test::diffuse(0.5));
  test::add_box(scene, {0, 0, 0}, {4, 3, 2.5}, grey, true);
  Random random(11);
  for (int k = 0; k < 12; ++k)
    test::add_polygon(scene, reference::random_polygon(random, {2, 1.5, 1.2}, 0.2 + random.unit(), 0.6), grey);
  const Polygon ell{{1, 1, 0.7}, {3, 1, 0.7}, {3, 1.5, 0.7}, {1.5, 1.5, 0.7}, {1.5, 2.5, 0.7}, {1, 2.5, 0.7}};
  for (const auto& piece : convex_pieces(ell)) {
    Polygon corners;
    for (const std::uint32_t k : piece) corners.push_back(ell[k]);
    test::add_polygon(scene, corners, grey);
  }
  Polygon disc;
  for (int k = 0; k < 64; ++k) disc.push_back({2 + std::cos(k * 0.0981747704), 1.5 + std::sin(k * 0.0981747704), 2});
  test::add_polygon(scene, disc, grey);
  return scene;
}

/// What must hold for every mesh; lengths in units of the scene's size.
void expect_sound(const Scene& scene, const Mesh& mesh) {
  const Vec3 size = bounds(scene).size();
  const double extent = std::max({size.x, size.y, size.z}), near = 1e-6 * extent;
  std::vector<double> front(scene.surfaces.size(), 0), back = front;
  REQUIRE(mesh.group_is_lit.size() == mesh.groups.size());
  std::uint32_t next_patch = 0, next_element = 0;
  for (const Group& group : mesh.groups) {
    const Plane& plane = mesh.planes[group.plane.value];
    const Surface& surface = scene.surfaces[group.surface.value];
    REQUIRE(glm::dot(plane.normal, surface.normal) * (group.back ? -1 : 1) > 1 - 1e-9);
    REQUIRE(glm::length(glm::cross(plane.u, plane.v) - plane.normal) < 1e-9);
    REQUIRE((group.patch_count >= 1 && group.patch_count <= 64));
    REQUIRE(group.first_patch == next_patch);
    const auto outline = mesh.polygon(group.polygon);
    REQUIRE(signed_area(outline) == doctest::Approx(group.area).epsilon(1e-6));
    for (const Vec2& c : outline) {
      const Vec3 p = plane.point(c);
      REQUIRE(glm::length(p - group.centre) <= group.radius + near);
      for (int axis = 0; axis < 3; ++axis) {
        REQUIRE(p[axis] >= mesh.lines[axis][group.block[axis]] - near);
        REQUIRE(p[axis] <= mesh.lines[axis][group.block[axis] + 1] + near);
      }
    }
    double patch_area = 0;
    for (std::uint32_t p = group.first_patch; p < group.first_patch + group.patch_count; ++p) {
      const Patch& patch = mesh.patches[p];
      patch_area += patch.area;
      REQUIRE(mesh.groups[patch.group.value].first_patch == group.first_patch);
      REQUIRE(patch.branch < 16);
      if (p > group.first_patch) REQUIRE(patch.branch >= mesh.patches[p - 1].branch);
      REQUIRE((patch.plane == group.plane && patch.surface == group.surface && patch.back == group.back));
      REQUIRE((patch.columns * patch.rows <= 16 && patch.element_count <= patch.columns * patch.rows));
      REQUIRE(patch.first_element == next_element);
      REQUIRE(patch.polygon.count <= 20);
      double element_area = 0;
      for (std::uint32_t e = patch.first_element; e < patch.first_element + patch.element_count; ++e) {
        const Element& element = mesh.elements[e];
        element_area += element.area;
        Vec2 lo, hi;
        mesh.element_rectangle(patch, element, lo, hi);
        REQUIRE((element.centre.x >= lo.x - near && element.centre.x <= hi.x + near));
        REQUIRE((element.centre.y >= lo.y - near && element.centre.y <= hi.y + near));
        REQUIRE(element.area <= (hi.x - lo.x) * (hi.y - lo.y) * (1 + 1e-6));
      }
      REQUIRE(element_area == doctest::Approx(patch.area).epsilon(1e-6));
      next_element += patch.element_count;
    }
    REQUIRE(patch_area == doctest::Approx(group.area).epsilon(1e-6));
    next_patch += group.patch_count;
    (group.back ? back : front)[group.surface.value] += group.area;
  }
  CHECK(next_patch == mesh.patches.size());
  CHECK(next_element == mesh.elements.size());
  for (std::size_t s = 0; s < scene.surfaces.size(); ++s) {
    CHECK(front[s] == doctest::Approx(scene.surfaces[s].area).epsilon(1e-6));
    CHECK(back[s] == doctest::Approx(scene.surfaces[s].area).epsilon(1e-6));
  }
}

}  // namespace

TEST_SUITE("mesh") {
  TEST_CASE("mesh: patches and elements fill both sides of every surface, each group in one block") {
    for (const double patch_size : {3.0, 0.7, 0.3, 0.13}) {
      CAPTURE(patch_size);
      expect_sound(mixed_scene(), mesh_with(mixed_scene(), patch_size));
      expect_sound(*test::two_rooms(), mesh_with(*test::two_rooms(), patch_size));
      for (const double patches_along : {1, 2}) {
        expect_sound(mixed_scene(), mesh_with(mixed_scene(), patch_size, patch_size / patches_along));
        expect_sound(*test::two_rooms(), mesh_with(*test::two_rooms(), patch_size, patch_size / patches_along));
      }
    }
  }

  TEST_CASE("mesh: a group is about 8x8 elements, however many of them are a patch") {
    Scene scene;
    test::add_polygon(scene, {{0, 0, 0}, {8, 0, 0}, {8, 8, 0}, {0, 8, 0}},
                      test::add_material(scene, test::diffuse(0.5)));
    for (const int along : {1, 2, 4}) {  // elements along the side of a patch
      const Mesh mesh = mesh_with(scene, 0.25 * along, 0.25);
      CAPTURE(along);
      CHECK(mesh.groups.size() == 2 * 16);
      CHECK(mesh.elements.size() == 2 * 1024);
      for (const Group& group : mesh.groups) {
        CHECK(group.patch_count == 64 / along / along);
        std::array<int, 16> patches_of_branch{};
        for (std::uint32_t p = 0; p < group.patch_count; ++p)
          ++patches_of_branch[mesh.patches[group.first_patch + p].branch];
        // 16 quarters of quarters, 4 quarters, or the group itself: of 4 patches each.
        for (std::size_t b = 0; b < 16; ++b) CHECK(patches_of_branch[b] == (b < group.patch_count / 4 ? 4 : 0));
      }
    }
  }

  TEST_CASE("mesh: patches do not overlap") {
    const Scene scene = mixed_scene();
    const Mesh mesh = mesh_with(scene, 0.3);
    Random random(3);
    for (int trial = 0; trial < 2000; ++trial) {
      const std::uint32_t s = random.below(static_cast<std::uint32_t>(scene.surfaces.size()));
      Vec3 point{0.0};
      double weight = 0;
      for (const Vec3& c : scene.surfaces[s].corners) {
        const double w = 0.01 + random.unit();
        point += w * c, weight += w;
      }
      point /= weight;
      int holders[2] = {0, 0};
      bool on_edge = false;
      for (const Patch& patch : mesh.patches) {
        if (patch.surface.value != s) continue;
        const Vec2 p = mesh.planes[patch.plane.value].coordinates(point);
        const auto outline = mesh.polygon(patch.polygon);
        double nearest = 1e9;
        for (std::size_t k = 0; k < outline.size(); ++k) {
          const Vec2 edge = outline[(k + 1) % outline.size()] - outline[k], d = p - outline[k];
          nearest = std::min(nearest, (edge.x * d.y - edge.y * d.x) / glm::length(edge));
        }
        on_edge |= std::abs(nearest) < 1e-6;
        holders[patch.back] += nearest > 0;
      }
      if (on_edge) continue;
      REQUIRE(holders[0] == 1);
      REQUIRE(holders[1] == 1);
    }
  }

  TEST_CASE("mesh: the same scene far away, tiny or huge has the same mesh") {
    const Scene scene = mixed_scene();
    const Mesh mesh = mesh_with(scene, 0.4);
    struct Case {
      double scale;
      Vec3 shift;
    };
    // Powers of two round nothing. A shift does, and where two cuts are equally good it may choose the other.
    for (const Case& c : {Case{1, {1e6, -1e6, 1e6}}, Case{0x1p-10, Vec3{0.0}}, Case{0x1p13, Vec3{0.0}}}) {
      const double rounding = c.shift == Vec3{0.0} ? 1e-12 : 0.03;
      Scene moved = scene;
      for (Surface& surface : moved.surfaces) {
        for (Vec3& p : surface.corners) p = c.scale * p + c.shift;
        surface.area *= c.scale * c.scale;
      }
      const Mesh other = mesh_with(moved, 0.4 * c.scale);
      CAPTURE(c.scale);
      expect_sound(moved, other);
      CHECK(double(other.groups.size()) == doctest::Approx(double(mesh.groups.size())).epsilon(rounding));
      CHECK(double(other.patches.size()) == doctest::Approx(double(mesh.patches.size())).epsilon(rounding));
      CHECK(double(other.elements.size()) == doctest::Approx(double(mesh.elements.size())).epsilon(rounding));
    }
  }

  TEST_CASE("mesh: a mesh made twice is the same, so every process has the same") {
    const Scene scene = mixed_scene();
    const Mesh a = mesh_with(scene, 0.25), b = mesh_with(scene, 0.25);
    CHECK(a.lines == b.lines);
    CHECK(a.corners == b.corners);
    REQUIRE(a.elements.size() == b.elements.size());
    for (std::size_t e = 0; e < a.elements.size(); ++e) REQUIRE(a.elements[e].centre == b.elements[e].centre);
  }

  TEST_CASE("mesh: coplanar sides that face alike share their plane, others do not") {
    Scene scene;
    const std::uint32_t grey = test::add_material(scene, test::diffuse(0.5)),
                        red = test::add_material(scene, test::diffuse(0.2));
    test::add_rectangle(scene, {0, 0, 0}, {1, 0, 0}, {0, 1, 0}, grey);
    test::add_rectangle(scene, {1, 0, 0}, {1, 0, 0}, {0, 1, 0}, red);
    test::add_rectangle(scene, {2, 0, 0}, {0, 1, 0}, {1, 0, 0}, red);      // faces down
    test::add_rectangle(scene, {3, 0, 1e-3}, {1, 0, 0}, {0, 1, 0}, grey);  // a step of a millimetre
    const Mesh mesh = mesh_with(scene, 0.5);
    const auto plane_of = [&](std::uint32_t surface, bool back) {
      for (const Group& group : mesh.groups)
        if (group.surface.value == surface && group.back == back) return group.plane;
      return PlaneId{~0u};
    };
    CHECK(plane_of(0, false) == plane_of(1, false));
    CHECK(plane_of(0, false) == plane_of(2, true));
    CHECK(plane_of(0, true) == plane_of(2, false));
    CHECK(plane_of(0, false) != plane_of(0, true));
    CHECK(plane_of(0, false) != plane_of(3, false));
  }

  TEST_CASE("mesh: block lines ascend, span the scene, and run through long walls") {
    const Mesh mesh = mesh_with(*test::two_rooms(), 0.3);
    for (int axis = 0; axis < 3; ++axis) {
      CHECK(std::is_sorted(mesh.lines[axis].begin(), mesh.lines[axis].end()));
      CHECK(std::adjacent_find(mesh.lines[axis].begin(), mesh.lines[axis].end()) == mesh.lines[axis].end());
      CHECK(mesh.lines[axis].front() == 0);
      CHECK(mesh.lines[axis].back() == std::array<double, 3>{8, 4, 2.5}[axis]);
      for (std::size_t k = 1; k < mesh.lines[axis].size(); ++k)
        CHECK(mesh.lines[axis][k] - mesh.lines[axis][k - 1] <= 1.2 * 0.6 + 1e-9);
    }
    CHECK(std::find(mesh.lines[0].begin(), mesh.lines[0].end(), 4.0) != mesh.lines[0].end());  // the wall between
  }

  TEST_CASE("mesh: a textured patch has the mean reflectance of its texture") {
    Scene scene;
    Texture ramp;
    ramp.width = 8, ramp.height = 1;
    for (int k = 0; k < 8; ++k) ramp.rgb.insert(ramp.rgb.end(), {k / 8.f, 0.5f, 1.f - k / 8.f});
    scene.textures.push_back(ramp);
    Material material = test::diffuse(0.8);
    material.texture = 0;
    test::add_rectangle(scene, {0, 0, 0}, {2, 0, 0}, {0, 1, 0}, test::add_material(scene, material));
    scene.surfaces[0].texcoords = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
    Rgb mean{0.0}, expected{0.0};
    double whole = 0;
    for (const Patch& patch : mesh_with(scene, 0.25).patches)
      mean += patch.area * patch.reflectance, whole += patch.area;
    for (int k = 0; k < 1000; ++k)
      expected += reflectance_at(scene, scene.surfaces[0], {2 * (k + 0.5) / 1000, 0.5, 0}) / 1000.0;
    CHECK(glm::length(mean / whole - expected) < 1e-3);
  }

  TEST_CASE("mesh: a luminaire emits from its front only, glass has no patches") {
    Scene scene;
    test::add_rectangle(scene, {0, 0, 0}, {1, 0, 0}, {0, 1, 0}, test::add_material(scene, test::luminous(2, 0.3)));
    test::add_rectangle(scene, {0, 0, 1}, {1, 0, 0}, {0, 1, 0}, test::add_material(scene, test::glass(1.5)));
    const Mesh mesh = mesh_with(scene, 0.5);
    for (const Patch& patch : mesh.patches) {
      CHECK(patch.surface.value == 0);
      CHECK(patch.exitance.x == doctest::Approx(patch.back ? 0 : 2 * std::numbers::pi));
      CHECK(patch.reflectance == Rgb{0.3});
    }
  }

  TEST_CASE("mesh: luminaires have places by their power, however coarse the mesh is") {
    Scene scene;
    const std::uint32_t wall = test::add_material(scene, test::diffuse(0.5));
    const std::uint32_t lamp = test::add_material(scene, test::luminous(2));
    const std::uint32_t dim = test::add_material(scene, test::luminous(0.001));
    test::add_rectangle(scene, {0, 0, 0}, {8, 0, 0}, {0, 8, 0}, wall);
    test::add_rectangle(scene, {2, 2, 1}, {0, 0.4, 0}, {0.4, 0, 0}, lamp);
    test::add_rectangle(scene, {5, 2, 1}, {0, 0.4, 0}, {0.4, 0, 0}, dim);
    const Mesh mesh = mesh_with(scene, 4.0);
    std::array<std::uint32_t, 3> places{};
    for (const Patch& patch : mesh.patches)
      if (!patch.back) places[patch.surface.value] += shooting_columns(patch) * shooting_rows(patch);
    CHECK(places[0] == 64);
    CHECK(places[1] == 16);  // as many as a patch may have
    CHECK(places[2] == 1);
  }

  TEST_CASE("mesh: dark sides get no patches behind and dormant ones in front") {
    Scene scene;
    const std::uint32_t grey = test::add_material(scene, test::diffuse(0.5));
    test::add_rectangle(scene, {0, 0, 0}, {1, 0, 0}, {0, 1, 0}, grey);
    test::add_rectangle(scene, {0, 0, 1}, {1, 0, 0}, {0, 1, 0}, grey);
    const std::vector<LitSides> lit{{true, false}, {false, true}};
    const Mesh mesh = mesh_of(scene, {0.5, 0, 0}, lit);
    for (std::size_t g = 0; g < mesh.groups.size(); ++g) {
      const Group& group = mesh.groups[g];
      CHECK((group.surface.value == 1 || !group.back));
      CHECK(bool(mesh.group_is_lit[g]) == (group.surface.value == 0 || group.back));
    }
  }

  TEST_CASE("mesh: about as many elements as were asked for") {
    for (const std::uint32_t target : {2000u, 12000u, 50000u}) {
      MeshOptions options;
      options.target_elements = target;
      const Mesh mesh = mesh_of(*test::two_rooms(), options, {});
      CHECK(mesh.elements.size() > target / 2);
      CHECK(mesh.elements.size() < target * 2);
      CHECK(mesh.options.patch_size > 0);
      CHECK(mesh.options.element_size == doctest::Approx(mesh.options.patch_size / 4));
    }
  }

  TEST_CASE("mesh: whether a needle is a patch does not depend on how places are divided") {
    Scene scene;
    const std::uint32_t grey = test::add_material(scene, test::diffuse(0.5));
    test::add_polygon(scene, {{1, 1, 0}, {1.05, 1.05, 0}, {1.05, 1.05 + 3e-11, 0}}, grey);
    test::add_rectangle(scene, {0, 0, 0}, {4, 0, 0}, {0, 4, 0}, grey);
    MeshOptions options;
    options.patch_size = 1;
    const Mesh plain = mesh_of(scene, options, {});
    const Mesh divided =
        mesh_of(scene, plain.options, {}, std::vector<PlaceTree>(places_of(plain).size(), PlaceTree::uniform(2)));
    REQUIRE(divided.patches.size() == plain.patches.size());
    for (std::size_t p = 0; p < plain.patches.size(); ++p) CHECK(divided.patches[p].surface == plain.patches[p].surface);
  }

  TEST_CASE("mesh: elements far smaller than their patch refine what receives, and leave what shoots") {
    MeshOptions options;
    options.patch_size = 0.8, options.element_size = 0.2;
    const Mesh coarse = mesh_of(*test::two_rooms(), options, {});
    options.element_size = 0.05;
    const Mesh fine = mesh_of(*test::two_rooms(), options, {});
    REQUIRE(fine.patches.size() == coarse.patches.size());
    CHECK(fine.groups.size() == coarse.groups.size());
    CHECK(fine.elements.size() > 14 * coarse.elements.size());
    for (std::size_t p = 0; p < fine.patches.size(); ++p) {
      REQUIRE(fine.patches[p].fineness == 4);
      REQUIRE(shooting_columns(fine.patches[p]) == coarse.patches[p].columns);
      REQUIRE(shooting_rows(fine.patches[p]) == coarse.patches[p].rows);
    }
    // As a solution file makes it anew.
    CHECK(mesh_of(*test::two_rooms(), fine.options, {}, fine.places).elements.size() == fine.elements.size());
  }
}
