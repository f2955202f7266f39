#include "io/coplanar_faces.hpp"

#include <doctest/doctest.h>

#include "core/scene/polygon.hpp"
#include "tests/support/rooms.hpp"

using namespace lichthof;
using namespace lichthof::io;
using namespace lichthof::test;

namespace {

/// Edges that are cut reach under the other face by 5e-8 of the scene.
constexpr double hair = 1e-6;

struct Cut {
  Scene scene;
  std::uint32_t grey = add_material(scene, diffuse(0.5)), lamp = add_material(scene, luminous(1));
  ImportReport report;

  void number_faces() {
    for (std::uint32_t s = 0; s < scene.surfaces.size(); ++s) scene.surfaces[s].source_face = s + 1;
  }
  void cut() {
    number_faces();
    cut_overlaps(
        scene, [](const Surface& s) { return "face " + std::to_string(s.source_face); }, report);
  }
  double area_of(std::uint32_t face) const {
    double sum = 0;
    for (const Surface& surface : scene.surfaces)
      if (surface.source_face == face) sum += area(surface.corners);
    return sum;
  }
};

}  // namespace

TEST_SUITE("io") {
  TEST_CASE("coplanar_faces: of two faces in one place the larger one is cut, whichever way they look") {
    for (const bool opposite : {false, true})
      for (const double lift : {0.0, 1e-7}) {
        Cut c;
        add_rectangle(c.scene, {0, 0, 0}, {4, 0, 0}, {0, 4, 0}, c.grey);
        const Vec3 u{2, 0, 0}, v{0, 1, 0};
        add_rectangle(c.scene, {1, 1, lift}, opposite ? v : u, opposite ? u : v, c.grey);
        c.cut();
        CHECK(c.report.coplanar_overlaps == 1);
        CHECK(c.report.notes ==
              std::vector<std::string>{"face 2: the face lies in the plane of the one in face 1 and overlaps it; that "
                                       "one was cut out there"});
        CHECK(c.area_of(1) == doctest::Approx(14).epsilon(hair));
        CHECK(c.area_of(2) == 2);
        CHECK(c.report.surfaces_made == c.scene.surfaces.size());
        for (const Surface& surface : c.scene.surfaces) {
          CHECK(is_convex(surface.corners));
          CHECK(surface.area == area(surface.corners));
          CHECK(surface.normal.z == (opposite && surface.source_face == 2 ? -1 : 1));
        }
      }
  }

  TEST_CASE("coplanar_faces: a luminaire stays whole in any larger or smaller face") {
    Cut c;
    add_rectangle(c.scene, {0, 0, 0}, {4, 0, 0}, {0, 4, 0}, c.lamp);
    add_rectangle(c.scene, {1, 1, 0}, {2, 0, 0}, {0, 1, 0}, c.grey);
    add_rectangle(c.scene, {3, 3, 0}, {2, 0, 0}, {0, 2, 0}, c.grey);
    c.cut();
    CHECK(c.area_of(1) == 16);
    CHECK(c.area_of(2) == doctest::Approx(0).epsilon(hair));
    CHECK(c.area_of(3) == doctest::Approx(3).epsilon(hair));
    CHECK(c.report.notes.size() == 2);
  }

  TEST_CASE("coplanar_faces: where three cover each other every place is left to one, and no gap opens") {
    Cut c;
    add_rectangle(c.scene, {0, 0, 0}, {4, 0, 0}, {0, 4, 0}, c.grey);
    add_polygon(c.scene, {{1, 1, 0}, {5, 1.5, 0}, {2, 4.5, 0}}, c.grey);
    add_rectangle(c.scene, {1.2, 1.5, 0}, {2, 0.3, 0}, {-0.3, 1, 0}, c.grey);
    c.cut();
    CHECK(c.report.coplanar_overlaps == 3);
    for (double x = 0.05; x < 4; x += 0.1)
      for (double y = 0.033; y < 4; y += 0.1) {
        int covers = 0;
        for (const Surface& surface : c.scene.surfaces) {
          bool inside = true;
          for (std::size_t k = 0; k < surface.corners.size(); ++k) {
            const Vec3 a = surface.corners[k], b = surface.corners[(k + 1) % surface.corners.size()];
            inside &= (b.x - a.x) * (y - a.y) - (b.y - a.y) * (x - a.x) > 0;
          }
          covers += inside;
        }
        CAPTURE(x);
        CAPTURE(y);
        REQUIRE(covers == 1);
      }
  }

  TEST_CASE("coplanar_faces: a cut texture stays in its place") {
    Cut c;
    c.scene.textures.push_back({"", 1, 1, {1, 1, 1}});
    c.scene.materials[c.grey].texture = 0;
    add_rectangle(c.scene, {0, 0, 0}, {4, 0, 0}, {0, 4, 0}, c.grey);
    c.scene.surfaces[0].texcoords = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
    add_rectangle(c.scene, {1, 1, 0}, {2, 0, 0}, {0, 1, 0}, c.lamp);
    c.cut();
    for (const Surface& surface : c.scene.surfaces) {
      if (surface.source_face != 1) continue;
      REQUIRE(surface.texcoords.size() == surface.corners.size());
      for (std::size_t k = 0; k < surface.corners.size(); ++k) {
        CHECK(surface.texcoords[k].x == doctest::Approx(surface.corners[k].x / 4));
        CHECK(surface.texcoords[k].y == doctest::Approx(surface.corners[k].y / 4));
      }
    }
  }

  TEST_CASE("coplanar_faces: neighbours along an edge, and sheets that rays can tell apart, stay as they are") {
    Cut c;
    add_rectangle(c.scene, {0, 0, 0}, {1, 0, 0}, {0, 1, 0}, c.grey);
    add_rectangle(c.scene, {1, 0, 0}, {1, 0, 0}, {0, 1, 0}, c.grey);
    add_rectangle(c.scene, {0.2, 0.2, 1e-5}, {0.5, 0, 0}, {0, 0.5, 0}, c.grey);
    const Scene before = c.scene;
    c.cut();
    CHECK(c.report.coplanar_overlaps == 0);
    REQUIRE(c.scene.surfaces.size() == 3);
    for (std::size_t s = 0; s < 3; ++s) CHECK(c.scene.surfaces[s].corners == before.surfaces[s].corners);
  }
}
