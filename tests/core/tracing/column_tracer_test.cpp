#include "core/tracing/column_tracer.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <numbers>

#include "tests/support/rooms.hpp"

using namespace lichthof;
using namespace lichthof::test;

namespace {

const Camera inside{"", {0.3, 0.2, 0.4}, {0.7, 0.9, 0.5}, {0, 0, 1}, 70};

ColumnTracer tracer(std::shared_ptr<const LitScene> scene, const Camera& camera, TracingOptions options,
                    std::uint32_t width = 24, std::uint32_t height = 18, unsigned threads = 1) {
  return ColumnTracer(std::move(scene), PinholeCamera(camera, width, height), options,
                      std::make_shared<Parallel>(threads));
}

std::vector<Rgbf> picture(const ColumnTracer& source) {
  std::uint64_t rays = 0;
  return source.columns({0, source.width()}, rays);
}

/// A room with everything in it: mirror, gloss, solid and thin glass, a shadow.
std::shared_ptr<Scene> mixed_room() {
  PanelRoom room(0.6);
  Scene& scene = *room.scene;
  add_box(scene, {0.5, 2.5, 0}, {1.5, 3.5, 1.4}, add_material(scene, specular(Finish::mirror, 0.8)), false);
  add_box(scene, {2.5, 2.5, 0.2}, {3.5, 3.3, 1.2}, add_material(scene, glass(1.5)), false);
  add_rectangle(scene, {1.6, 2, 0.3}, {0.8, 0, 0}, {0, 0, 1}, add_material(scene, glass(1.5)));
  add_rectangle(scene, {0.2, 0.5, 0.5}, {3, 0, 0}, {0, 1, 0},
                add_material(scene, specular(Finish::glossy, 0.3, 0.4, 30)));
  return room.scene;
}

}  // namespace

TEST_CASE("column_tracer: two-pass in a furnace is Ke/(1-ρ) in every pixel: direct light is counted once") {
  const Furnace furnace(1, 0.5);
  const auto scene = std::make_shared<LitScene>(furnace.solution());
  for (const std::uint32_t gather_rays : {0u, 64u})
    for (const std::uint32_t samples : {1u, 5u}) {
      TracingOptions options;
      options.samples = samples;
      options.gather_rays = gather_rays;
      for (const Rgbf& pixel : picture(tracer(scene, inside, options)))
        CHECK(pixel.x == doctest::Approx(2.0).epsilon(1e-4));
    }
}

TEST_CASE("column_tracer: method radiosity shows the field alone, raytrace the constant ambient light") {
  const Furnace furnace(1, 0.5);
  const auto scene = std::make_shared<LitScene>(furnace.solution());
  TracingOptions options;
  options.method = TracingMethod::radiosity;
  for (const Rgbf& pixel : picture(tracer(scene, inside, options)))
    CHECK(pixel.x == doctest::Approx(2.0).epsilon(1e-5));
  // The mean of the indirect irradiance is the exact ambient term here; a given one replaces it.
  options.method = TracingMethod::raytrace;
  for (const Rgbf& pixel : picture(tracer(scene, inside, options)))
    CHECK(pixel.x == doctest::Approx(2.0).epsilon(1e-4));
  options.ambient = Rgb{0.0};
  for (const Rgbf& pixel : picture(tracer(scene, inside, options)))
    CHECK(pixel.x == doctest::Approx(1.5).epsilon(1e-4));
}

TEST_CASE("column_tracer: without a solution the ambient term is that of a closed room of the same surfaces") {
  const Furnace furnace(1, 0.5);
  TracingOptions options;
  options.method = TracingMethod::raytrace;
  for (const Rgbf& pixel : picture(tracer(std::make_shared<LitScene>(furnace.scene), inside, options)))
    CHECK(pixel.x == doctest::Approx(2.0).epsilon(1e-4));
}

TEST_CASE("column_tracer: the picture has the same bits for any partition and any number of threads") {
  const auto scene = std::make_shared<LitScene>(uniform_solution(mixed_room(), 0.3, 200, 90));
  const Camera camera{"", {2, 0.2, 1.5}, {2, 3, 1}, {0, 0, 1}, 70};
  TracingOptions options;
  options.samples = 3;
  const ColumnTracer one = tracer(scene, camera, options, 40, 30, 1), two = tracer(scene, camera, options, 40, 30, 2);
  const std::vector<Rgbf> whole = picture(one);
  for (const Rgbf& pixel : whole) CHECK(all_finite(Vec3{pixel}));
  CHECK(picture(two) == whole);
  std::vector<Rgbf> pieces(whole.size());
  std::uint64_t rays = 0;
  for (const auto& [first, last] : {std::pair{33u, 40u}, std::pair{0u, 1u}, std::pair{1u, 12u}, std::pair{12u, 33u}}) {
    const std::vector<Rgbf> part = two.columns({first, last}, rays);
    std::copy(part.begin(), part.end(), pieces.begin() + first * 30);
  }
  CHECK(pieces == whole);
}

TEST_CASE("column_tracer: a mirror shows what stands before it, dimmed by Ks") {
  // The eye looks at a mirror at y = 2; behind it, at y = -1, hangs a panel.
  auto scene = std::make_shared<Scene>();
  add_rectangle(*scene, {-5, 2, -5}, {10, 0, 0}, {0, 0, 10}, add_material(*scene, specular(Finish::mirror, 0.75)));
  add_rectangle(*scene, {-20, -1, 20}, {40, 0, 0}, {0, 0, -40}, add_material(*scene, luminous(4)));
  const auto lit = std::make_shared<LitScene>(uniform_solution(scene, 5, 0, 0));
  const Camera camera{"", {0, 0, 0}, {0, 1, 0}, {0, 0, 1}, 30};
  for (const Rgbf& pixel : picture(tracer(lit, camera, {}))) {
    const bool front = scene->surfaces[1].normal.y > 0;
    CHECK(pixel.x == doctest::Approx(front ? 3.0 : 0.0));
  }
}

TEST_CASE("column_tracer: a pane and a solid slab of glass let through what Fresnel says") {
  for (const bool solid : {false, true}) {
    auto scene = std::make_shared<Scene>();
    add_rectangle(*scene, {-50, 9, -50}, {100, 0, 0}, {0, 0, 100}, add_material(*scene, luminous(1)));
    const std::uint32_t clear = add_material(*scene, glass(1.52));
    if (solid)
      add_box(*scene, {-9, 3, -9}, {9, 4, 9}, clear, false);
    else
      add_rectangle(*scene, {-9, 3, -9}, {18, 0, 0}, {0, 0, 18}, clear);
    if (scene->surfaces[0].normal.y > 0)
      std::reverse(scene->surfaces[0].corners.begin(), scene->surfaces[0].corners.end());
    scene->surfaces[0].normal = {0, -1, 0};
    const auto lit = std::make_shared<LitScene>(uniform_solution(scene, 30, 0, 0));
    TracingOptions options;
    options.samples = 1;
    options.throughput_cut = 1e-7;
    const Camera camera{"", {0, 0, 0}, {0, 1, 0}, {0, 0, 1}, 2};
    for (const Rgbf& pixel : picture(tracer(lit, camera, options, 4, 4)))
      CHECK(pixel.x == doctest::Approx(0.9183).epsilon(2e-4));
  }
}

TEST_CASE("column_tracer: a texture modulates the light, not the irradiance") {
  Furnace furnace(0, 0.5);
  Texture stripes;
  stripes.width = 2, stripes.height = 1;
  stripes.rgb = {1, 1, 1, 0.5f, 0.5f, 0.5f};
  furnace.scene->textures.push_back(stripes);
  furnace.scene->materials[0].texture = 0;
  for (Surface& surface : furnace.scene->surfaces) surface.texcoords = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
  const auto lit = std::make_shared<LitScene>(uniform_solution(furnace.scene, 0.1, std::numbers::pi, 0));
  // Straight down on the floor: texel centres lie at a quarter and three quarters.
  const Camera camera{"", {0.5, 0.5, 0.5}, {0.5, 0.5, 0}, {0, 1, 0}, 90};
  TracingOptions options;
  options.samples = 1;
  const std::vector<Rgbf> image = picture(tracer(lit, camera, options, 2, 2));
  float low = 1, high = 0;
  for (const Rgbf& pixel : image) low = std::min(low, pixel.x), high = std::max(high, pixel.x);
  CHECK(low == doctest::Approx(0.25));
  CHECK(high == doctest::Approx(0.5));
}

TEST_CASE("column_tracer: samples of a pixel lie inside it and spread") {
  Vec2 sum{0.0};
  for (std::uint32_t i = 0; i < 16; ++i) {
    const Vec2 p = place_in_pixel(i, 16, 99);
    CHECK((p.x >= 0 && p.x < 1 && p.y >= 0 && p.y < 1));
    sum += p;
  }
  CHECK(sum.x / 16 == doctest::Approx(0.5).epsilon(0.15));
  CHECK(place_in_pixel(0, 1, 99) == Vec2{0.5});
}
