#include "core/light/local_shot.hpp"

#include <doctest/doctest.h>

#include <algorithm>

#include "tests/support/hemicube_reference.hpp"
#include "tests/support/one_cell.hpp"
#include "tests/support/rooms.hpp"

using namespace lichthof;

namespace {

/// Luminaires of all shapes in a room.
std::shared_ptr<const Scene> shining_shapes() {
  Scene scene;
  const std::uint32_t wall = test::add_material(scene, test::diffuse(0.5));
  test::add_box(scene, {0, 0, 0}, {4, 3, 2.5}, wall, true);
  Material shining = test::diffuse(0.5);
  shining.radiance = Rgb{1, 2, 3};
  const std::uint32_t lamp = test::add_material(scene, shining);
  Random random(7);
  for (int k = 0; k < 12; ++k)
    test::add_polygon(scene, reference::random_polygon(random, {2, 1.5, 1.2}, 0.2 + random.unit(), 0.6), lamp);
  return std::make_shared<const Scene>(std::move(scene));
}

double area_of(const FlatSource& source) {
  Polygon corners;
  for (int k = 0; k < source.flat.count; ++k) corners.push_back({source.flat.x[k], source.flat.y[k], source.flat.z[k]});
  return area(corners);
}

/// Power of all channels (W).
double power_of(const FlatSource& source) {
  double sum = 0;
  for (int c = 0; c < 3; ++c) sum += source.reflected[c] + source.emitted[c];
  return sum * area_of(source);
}

}  // namespace

TEST_SUITE("local_shot") {
  TEST_CASE("local_shot: at every level of detail the parts fill the group and send its power") {
    const auto scene = shining_shapes();
    for (const double patches_along : {1.0, 2.0, 4.0}) {
      MeshOptions options;
      options.patch_size = 0.1 * patches_along, options.element_size = 0.1;
      const auto mesh = std::make_shared<const Mesh>(mesh_of(*scene, options, {}));
      test::OneCell cell(scene, mesh);
      std::size_t deepest = 0;
      for (int shots = 0; shots < 60; ++shots) {
        const CellLight::Candidate next = cell.light.strongest();
        const Shot shot = cell.light.take_shot(next.group, {CellId{0}, static_cast<std::uint64_t>(shots)}, {});
        const LocalShot local = local_shot(shot, Vec3{2, 1.5, 1.25});
        REQUIRE(local.parts.front().end == local.parts.size());
        CHECK(area_of(local.group()) == doctest::Approx(shot.area).epsilon(1e-4));
        const Rgb power = shot.power();
        CHECK(power_of(local.group()) == doctest::Approx(power.x + power.y + power.z).epsilon(1e-4));
        for (std::uint32_t p = 0; p < local.parts.size(); ++p) {
          const ShotPart& part = local.parts[p];
          if (part.level == ShotPart::Level::element) {
            CHECK(part.end == p + 1);
            continue;
          }
          double pieces_area = 0, pieces_power = 0;
          for (std::uint32_t child = p + 1; child < part.end; child = local.parts[child].end) {
            CHECK(local.parts[child].level >= part.level);
            pieces_area += area_of(local.parts[child].source);
            pieces_power += power_of(local.parts[child].source);
            if (p == 0 && local.parts[child].level == ShotPart::Level::branch)
              deepest = std::max<std::size_t>(deepest, 2);
            if (p > 0 && local.parts[child].level == ShotPart::Level::branch) deepest = 3;
          }
          CHECK(pieces_area == doctest::Approx(area_of(part.source)).epsilon(1e-4));
          CHECK(pieces_power == doctest::Approx(power_of(part.source)).epsilon(1e-4));
        }
        cell.light.receive(shot, nullptr);
      }
      CHECK(deepest == (patches_along == 1 ? 3 : patches_along == 2 ? 2 : 0));
    }
  }

  TEST_CASE("local_shot: a shot of no area, as a peer may send it, sends nothing") {
    const auto scene = shining_shapes();
    MeshOptions options;
    options.patch_size = options.element_size = 0.1;
    test::OneCell cell(scene, std::make_shared<const Mesh>(mesh_of(*scene, options, {})));
    Shot shot = cell.light.take_shot(cell.light.strongest().group, {CellId{0}, 0}, {});
    for (ShotPatch& patch : shot.patches) std::fill(patch.area.begin(), patch.area.end(), 0.f);
    for (const ShotPart& part : local_shot(shot, Vec3{0.0}).parts)
      if (part.level == ShotPart::Level::branch) CHECK(power_of(part.source) == 0);
  }
}
