#include <doctest/doctest.h>

#include "core/light/balance.hpp"
#include "tests/support/rooms.hpp"

using namespace lichthof;

namespace {

/// Every element has shot the same radiosity, 1 W/m² per channel, unless its group is kept silent.
Solution shining(const std::shared_ptr<const Scene>& scene, double patch_size) {
  Solution solution;
  solution.scene = scene;
  MeshOptions options;
  options.patch_size = patch_size;
  solution.mesh = std::make_shared<const Mesh>(mesh_of(*scene, options, {}));
  solution.shot.assign(solution.mesh->elements.size(), Rgbf{1.f});
  for (auto* values : {&solution.irradiance, &solution.direct_irradiance})
    values->assign(solution.mesh->elements.size(), Rgbf{0.f});
  return solution;
}

double escaped_power(Solution solution, const Parallel& parallel) {
  balance(solution, parallel);
  return solution.energy.escaped;
}

void silence(Solution& solution, std::uint32_t surface) {
  for (const Patch& patch : solution.mesh->patches)
    if (patch.surface.value == surface)
      for (std::uint32_t e = patch.first_element; e < patch.first_element + patch.element_count; ++e)
        solution.shot[e] = Rgbf{0.f};
}

}  // namespace

TEST_SUITE("escape") {
  const Parallel one(1);

  TEST_CASE("escape: all light leaves a lone sheet, both sides shining") {
    auto scene = std::make_shared<Scene>();
    test::add_rectangle(*scene, {0, 0, 0}, {2, 0, 0}, {0, 3, 0}, test::add_material(*scene, test::diffuse(0.5)));
    CHECK(escaped_power(shining(scene, 0.5), one) == doctest::Approx(2 * 3 * 6.0));
  }

  TEST_CASE("escape: no light leaves a closed room") {
    auto scene = std::make_shared<Scene>();
    test::add_box(*scene, {0, 0, 0}, {4, 3, 2.5}, test::add_material(*scene, test::diffuse(0.5)), true);
    Solution solution = shining(scene, 0.5);
    // The outsides shine into the open: what leaves is half of all.
    double outside = 0;
    for (const Patch& patch : solution.mesh->patches) outside += patch.back ? 3 * patch.area : 0;
    CHECK(escaped_power(solution, one) == doctest::Approx(outside));
  }

  TEST_CASE("escape: of a unit square's light one part in five meets the square opposite") {
    auto scene = std::make_shared<Scene>();
    const std::uint32_t grey = test::add_material(*scene, test::diffuse(0.5));
    test::add_rectangle(*scene, {0, 0, 0}, {1, 0, 0}, {0, 1, 0}, grey);
    test::add_rectangle(*scene, {0, 0, 1}, {1, 0, 0}, {0, 1, 0}, grey);
    Solution solution = shining(scene, 0.05);
    silence(solution, 1);
    // The front sees the other square with the form factor 0.19982; the back sees nothing.
    CHECK(escaped_power(solution, one) == doctest::Approx(3 * (2 - 0.19982)).epsilon(0.004));
  }

  TEST_CASE("escape: glass lets light pass") {
    auto scene = std::make_shared<Scene>();
    test::add_rectangle(*scene, {0, 0, 0}, {1, 0, 0}, {0, 1, 0}, test::add_material(*scene, test::diffuse(0.5)));
    test::add_box(*scene, {-1, -1, -1}, {2, 2, 1}, test::add_material(*scene, test::glass(1.5)), false);
    CHECK(escaped_power(shining(scene, 0.5), one) == doctest::Approx(6.0));
  }

  TEST_CASE("escape: negative shots count against the others, and threads do not matter") {
    auto scene = std::make_shared<Scene>();
    const std::uint32_t grey = test::add_material(*scene, test::diffuse(0.5));
    test::add_rectangle(*scene, {0, 0, 0}, {3, 0, 0}, {0, 3, 0}, grey);
    test::add_rectangle(*scene, {0, 0, 1}, {1, 0, 1}, {0, 1, 0}, grey);
    Solution solution = shining(scene, 0.2);
    const double before = escaped_power(solution, one);
    CHECK(escaped_power(solution, Parallel(2)) == before);
    for (Rgbf& shot : solution.shot) shot = -shot;
    CHECK(escaped_power(solution, one) == doctest::Approx(-before));
  }
}
