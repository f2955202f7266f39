/// §3: the second pass. Each case: the scene, the steps, what must come out.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <vector>

#include "core/tracing/balancer.hpp"
#include "core/tracing/column_tracer.hpp"
#include "core/tracing/path_tracer.hpp"
#include "core/tracing/worker.hpp"
#include "tests/support/rooms.hpp"

using namespace lichthof;
using namespace lichthof::test;

namespace {

const Camera eye{"", {2, 0.4, 1.6}, {2.1, 3.2, 1.2}, {0, 0, 1}, 65};

/// The panel room, of reflectance ½, with a first pass written down: indirect light that falls from the front to the back.
Solution sloping_solution() {
  Solution solution = uniform_solution(PanelRoom(0.5).scene, 0.25, 0, 0);
  const Mesh& mesh = *solution.mesh;
  const std::vector<Rgb> indirect = values_on(mesh, [](const Vec3& p) {
    return Rgb{100 - 10 * p.y, 80 - 8 * p.y, 60};
  });
  const std::vector<Rgb> direct = values_on(mesh, [](const Vec3& p) { return Rgb{40 - 10 * p.z}; });
  for (std::size_t e = 0; e < indirect.size(); ++e) {
    solution.irradiance[e] = Rgbf{indirect[e] + direct[e]};
    solution.direct_irradiance[e] = Rgbf{direct[e]};
  }
  return solution;
}

ColumnTracer tracer(std::shared_ptr<const LitScene> scene, TracingMethod method, std::uint32_t width = 24) {
  TracingOptions options;
  options.method = method;
  options.samples = 1;
  return ColumnTracer(std::move(scene), PinholeCamera(eye, width, 18), options, std::make_shared<Parallel>(1));
}

/// What each pixel's middle ray meets, and the radiance a function gives for it.
template <class Function>
void for_each_pixel(const LitScene& scene, const ColumnTracer& source, Function function) {
  const PinholeCamera film(eye, source.width(), source.height());
  std::uint64_t rays = 0;
  for (std::uint32_t column = 0; column < source.width(); ++column)
    for (std::uint32_t row = 0; row < source.height(); ++row) {
      const auto at = scene.trace().nearest(film.eye(), film.direction({column + 0.5, row + 0.5}));
      REQUIRE(at);
      if (scene.trace().scene().material_of(scene.trace().scene().surfaces[at->surface]).emits()) continue;
      function(*at, source.pixel(column, row, rays));
    }
}

/// Shares out the columns of a source with a balancer and N workers, whoever has work is next by chance.
Image shared_out(std::shared_ptr<const ColumnSource> source, std::uint32_t count, std::uint64_t seed) {
  Balancer balancer({source->width(), source->height(), count, Scheduling::adaptive, 4, 64});
  std::vector<Worker> workers;
  for (std::uint32_t w = 0; w < count; ++w) workers.emplace_back(WorkerId{w}, source, 2);
  Random random(seed);
  while (!balancer.finished()) {
    const std::uint32_t pick = random.below(count + 1);
    Effects effects;
    if (pick == count) {
      if (!balancer.has_work()) continue;
      effects = balancer.step({});
    } else {
      if (!workers[pick].has_work()) continue;
      effects = workers[pick].step({});
    }
    for (const Envelope& envelope : effects.outbox)
      if (const auto* worker = std::get_if<WorkerId>(&envelope.to))
        workers[worker->value].accept(envelope, {});
      else
        balancer.accept(envelope, {});
  }
  return balancer.image();
}

}  // namespace

TEST_SUITE("paper §3") {
  TEST_CASE("§3: the ambient term is the radiosity of the first pass") {
    const Solution solution = sloping_solution();
    const auto scene = std::make_shared<LitScene>(solution);
    const ColumnTracer two_pass = tracer(scene, TracingMethod::two_pass),
                       plain = tracer(scene, TracingMethod::raytrace);
    std::uint64_t rays = 0;
    const DirectOptions direct{256, 64, {}};
    for_each_pixel(*scene, two_pass, [&](const SurfacePoint& at, const Rgb& seen) {
      const Rgb sampled = scene->direct().irradiance(at.point, at.normal, direct, rays);
      const double expected = 0.5 / std::numbers::pi * (sampled.x + 100 - 10 * at.point.y);
      CHECK(seen.x == doctest::Approx(expected).epsilon(1e-5));
    });
    // The generic algorithm has a constant there instead.
    for_each_pixel(*scene, plain, [&](const SurfacePoint& at, const Rgb& seen) {
      const Rgb sampled = scene->direct().irradiance(at.point, at.normal, direct, rays);
      CHECK(seen.x == doctest::Approx(0.5 / std::numbers::pi * (sampled.x + scene->mean_indirect().x)).epsilon(1e-5));
    });
  }

  TEST_CASE("§3: direct light is counted once") {
    // In the furnace everything is known: πKe comes straight, πKe ρ/(1-ρ) by reflection, Ke/(1-ρ) is seen.
    const Furnace furnace(1, 0.8);
    const auto scene = std::make_shared<LitScene>(furnace.solution());
    for (const auto method : {TracingMethod::radiosity, TracingMethod::two_pass}) {
      const ColumnTracer source =
          ColumnTracer(scene, PinholeCamera({"", {0.2, 0.2, 0.5}, {1, 1, 0.4}, {0, 0, 1}, 80}, 16, 12),
                       {method, 2, 12, 2e-3, 4, 0, {}}, std::make_shared<Parallel>(1));
      std::uint64_t rays = 0;
      for (const Rgbf& pixel : source.columns({0, 16}, rays)) CHECK(pixel.x == doctest::Approx(5).epsilon(1e-4));
    }
  }

  TEST_CASE("§3: the second pass traces the scene with the first pass's radiosity") {
    // Both methods see the same light where the first pass is right, the path tracer agrees without any first pass:
    // a furnace with a mirror in it, where mirrors are invisible.
    Furnace furnace(1, 0.5);
    add_rectangle(*furnace.scene, {0.3, 0.7, 0.2}, {0.5, 0.1, 0}, {0, 0, 0.5},
                  add_material(*furnace.scene, specular(Finish::mirror, 1.0)));
    const auto scene = std::make_shared<LitScene>(furnace.solution());
    const PinholeCamera film({"", {0.4, 0.2, 0.4}, {0.6, 0.9, 0.45}, {0, 0, 1}, 70}, 12, 9);
    const ColumnTracer source(scene, film, {TracingMethod::two_pass, 1, 12, 1e-4, 4, 0, {}},
                              std::make_shared<Parallel>(1));
    const PathTracer reference(scene);
    std::uint64_t rays = 0;
    for (std::uint32_t i = 0; i < 12 * 9; ++i) {
      const Estimate expected = reference.pixel(film, i % 12, i / 12, 800, rays);
      // The mirror hides luminous walls from shadow rays, and the first pass knows no mirrors: a few per cent are missing.
      CHECK(std::abs(source.pixel(i % 12, i / 12, rays).x - expected.mean.x) < 0.35);
      CHECK(std::abs(expected.mean.x - 2) <= 5 * expected.standard_error.x + 1e-3);
    }
  }

  TEST_CASE("§3: a worker traces any column alone") {
    const auto scene = std::make_shared<LitScene>(sloping_solution());
    const auto source = std::make_shared<ColumnTracer>(tracer(scene, TracingMethod::two_pass));
    std::uint64_t rays = 0;
    const std::vector<Rgbf> whole = source->columns({0, 24}, rays);
    Worker worker(WorkerId{7}, source);
    (void)worker.step({});
    worker.accept({ToBalancer{}, WorkerId{7}, JobAssignment{{13, 14}, false}}, {});
    const Effects done = worker.step({});
    const auto& result = std::get<ColumnResult>(done.outbox.at(0).message);
    CHECK(std::equal(result.pixels.begin(), result.pixels.end(), whole.begin() + 13 * 18, whole.begin() + 14 * 18));
  }

  TEST_CASE("§3: the image is the same for every number of workers") {
    const auto scene = std::make_shared<LitScene>(sloping_solution());
    TracingOptions options;
    options.samples = 3;
    const auto source =
        std::make_shared<ColumnTracer>(scene, PinholeCamera(eye, 40, 10), options, std::make_shared<Parallel>(1));
    const Image alone = shared_out(source, 1, 1);
    std::uint64_t rays = 0;
    Image at_once(40, 10);
    at_once.set_columns(0, source->columns({0, 40}, rays));
    CHECK(alone == at_once);
    for (const std::uint32_t workers : {2u, 5u, 17u}) CHECK(shared_out(source, workers, workers) == alone);
  }
}
