#include "core/tracing/mirror_images.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <numbers>

#include "core/light/form_factor.hpp"
#include "core/tracing/direct_light.hpp"
#include "core/tracing/path_tracer.hpp"
#include "core/tracing/probe.hpp"
#include "tests/support/rooms.hpp"

using namespace lichthof;
using namespace lichthof::test;

namespace {

constexpr double radiance = 10, share = 0.8;

/// A black room of 4 x 4 x 3 m with a mirror on the wall x = 0 and a panel that faces it, and the floor.
struct MirrorRoom {
  std::shared_ptr<Scene> scene = std::make_shared<Scene>();
  std::uint32_t black, mirror;
  explicit MirrorRoom(const Vec3& mirror_corner = {0.01, 0.5, 0.3}, double wide = 3, double high = 2.4) {
    black = add_material(*scene, diffuse(0));
    mirror = add_material(*scene, specular(Finish::mirror, share));
    add_box(*scene, {0, 0, 0}, {4, 4, 3}, black, true);
    add_rectangle(*scene, mirror_corner, {0, wide, 0}, {0, 0, high}, mirror);
    add_rectangle(*scene, {2, 1.5, 2.8}, {0, 1, 0}, {0.5, 0, -0.5}, add_material(*scene, luminous(radiance)));
  }
  std::shared_ptr<const LitScene> lit() const { return std::make_shared<LitScene>(uniform_solution(scene, 0.5, 0, 0)); }
};

}  // namespace

TEST_CASE("mirror_images: seen whole, an image brings what its luminaire would from there") {
  const MirrorRoom room({0.01, -50, -50}, 100, 100);
  const Surface& lamp = room.scene->surfaces.back();
  Polygon image;
  for (const Vec3& c : lamp.corners) image.push_back({0.02 - c.x, c.y, c.z});
  std::reverse(image.begin(), image.end());
  const MirrorImages images(std::make_shared<TraceScene>(room.scene));
  std::uint64_t rays = 0;
  for (const Vec3& point : {Vec3{1, 2, 0}, Vec3{3, 0.5, 0}, Vec3{0.2, 3.5, 0}}) {
    const Vec3 up{0, 0, 1};
    const double wanted = share * std::numbers::pi * radiance * form_factor(point, up, image);
    CHECK(wanted > 0.01);
    CHECK(std::abs(images.irradiance(point, up, 4, 1, rays).x / wanted - 1) < 1e-9);
  }
}

TEST_CASE("mirror_images: what the outline cuts off and what stands in the way counts, as in path tracing") {
  MirrorRoom room;
  add_box(*room.scene, {0.6, 1.8, 0}, {0.8, 2.4, 1.1}, room.black, false);
  add_box(*room.scene, {1.2, 1.2, 1.6}, {1.3, 1.8, 2.2}, room.black, false);
  const std::shared_ptr<const LitScene> lit = room.lit();
  const PathTracer tracer(lit);
  std::vector<SensorPoint> points;
  for (const double x : {0.4, 1.0, 1.6, 2.5, 3.4})
    for (const double y : {0.7, 1.5, 2.1, 3.0}) points.push_back({{x, y, 0}, {0, 0, 1}});
  ProbeOptions options;
  options.direct.rays = 1024, options.direct.rays_per_image = 4096;
  options.gather_rays = 256;
  std::uint64_t rays = 0;
  const std::vector<Rgb> light = sensor_irradiance(lit, points, options, Parallel(1), rays);
  int by_mirror = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Estimate wanted = tracer.irradiance(points[i], 1 << 16, i, rays);
    CAPTURE(i);
    // Five standard errors of the paths and of the 4096 rays, and what 64 parts of the lamp miss at edges of shadows.
    const double tolerance = 5 * wanted.standard_error.x + (5 * 0.5 / 64 * 0.3 + 0.01) * wanted.mean.x;
    CHECK(std::abs(light[i].x - wanted.mean.x) < tolerance);
    DirectOptions straight = options.direct;
    straight.rays_per_image = 0;
    by_mirror += lit->direct().irradiance(points[i].point, points[i].normal, straight, rays).x < 0.9 * light[i].x;
  }
  CHECK(by_mirror >= 5);
}

TEST_CASE("mirror_images: nothing for who stands behind the mirror, or in scenes without one") {
  const MirrorRoom room({2.5, 0.5, 0.3});
  const MirrorImages images(std::make_shared<TraceScene>(room.scene));
  std::uint64_t rays = 0;
  CHECK(!images.empty());
  CHECK(images.irradiance({3.5, 2, 0}, {0, 0, 1}, 16, 1, rays) == Rgb{0.0});
  CHECK(MirrorImages(std::make_shared<TraceScene>(PanelRoom().scene)).empty());
}
