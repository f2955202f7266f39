/// §4: the image synthesis system as a whole. Each case: the scene, the steps, what must come out.
#include <doctest/doctest.h>

#include <memory>
#include <numbers>

#include "core/tracing/column_tracer.hpp"
#include "tests/support/one_cell.hpp"
#include "tests/support/rooms.hpp"

using namespace lichthof;
using namespace lichthof::test;

TEST_SUITE("paper §4") {
  TEST_CASE("§4: a mirror shows the room by rays, the wall beside it by radiosity") {
    const PanelRoom room(0.5);
    const double share = 0.9;
    const std::uint32_t mirror = add_rectangle(*room.scene, {1, 3.9, 0.5}, {1.5, 0, 0}, {0, 0, 2},
                                               add_material(*room.scene, specular(Finish::mirror, share)));
    OneCell cell(room.scene, mesh_with(*room.scene, 0.5));
    cell.solve(1e-3);
    const auto lit = std::make_shared<LitScene>(cell.solution());
    const PinholeCamera film({"", {2, 0.4, 1.6}, {1.8, 4, 1.5}, {0, 0, 1}, 60}, 24, 18);
    TracingOptions options{TracingMethod::two_pass, 1, 12, 1e-6, 4, 0, {}};
    const ColumnTracer source(lit, film, options, std::make_shared<Parallel>(1));
    const DirectOptions direct{256, 64, {}};
    std::uint64_t rays = 0;
    const auto diffuse_radiance = [&](const SurfacePoint& at) {
      const Rgb irradiance = lit->direct().irradiance(at.point, at.normal, direct, rays) + lit->indirect_irradiance(at);
      return reflectance_at(lit->trace().scene(), lit->trace().scene().surfaces[at.surface], at.point).x *
             irradiance.x * std::numbers::inv_pi;
    };
    int in_mirror = 0, beside = 0;
    for (std::uint32_t column = 0; column < 24; ++column)
      for (std::uint32_t row = 0; row < 18; ++row) {
        const Vec3 way = film.direction({column + 0.5, row + 0.5});
        const auto at = lit->trace().nearest(film.eye(), way);
        REQUIRE(at);
        const double seen = source.pixel(column, row, rays).x;
        if (at->surface != mirror) {
          if (lit->trace().scene().material_of(lit->trace().scene().surfaces[at->surface]).radiance.x > 0) continue;
          CHECK(seen == doctest::Approx(diffuse_radiance(*at)).epsilon(0.03));
          ++beside;
          continue;
        }
        const Vec3 onwards = way - 2 * glm::dot(way, at->normal) * at->normal;
        const auto behind = lit->trace().nearest(lit->trace().lifted(*at), onwards);
        REQUIRE(behind);
        const Material& met = lit->trace().scene().material_of(lit->trace().scene().surfaces[behind->surface]);
        CHECK(seen == doctest::Approx(share * (met.radiance.x + diffuse_radiance(*behind))).epsilon(0.03));
        ++in_mirror;
      }
    CHECK(in_mirror > 20);
    CHECK(beside > 100);
  }
}
