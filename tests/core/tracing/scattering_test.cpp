#include "core/tracing/scattering.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <numbers>

#include "core/base/random.hpp"

using namespace lichthof;

namespace {
double cosine_of(double degrees) { return std::cos(degrees * std::numbers::pi / 180); }
}  // namespace

TEST_CASE("scattering: a pane of n = 1.52 transmits what Fresnel's equations with all internal reflections say") {
  // Degrees and transmittance; the table is rounded to four digits.
  const double table[][2] = {{0, .9183}, {15, .9182}, {30, .9160}, {45, .9025}, {60, .8435}, {75, .6148}, {80, .4560}};
  for (const auto& [degrees, transmittance] : table)
    CHECK(1 - pane_reflectance(cosine_of(degrees), 1.52) == doctest::Approx(transmittance).epsilon(1e-4));
}

TEST_CASE("scattering: one interface reflects ((n-1)/(n+1))² at normal incidence, alike from both sides") {
  CHECK(fresnel_reflectance(1, 1.5) == doctest::Approx(0.04));
  CHECK(fresnel_reflectance(1, 1 / 1.5) == doctest::Approx(0.04));
  // Reversibility: entering at 40 degrees equals leaving at the refracted angle.
  const double inside = std::sqrt(1 - std::pow(std::sin(40 * std::numbers::pi / 180) / 1.5, 2));
  CHECK(fresnel_reflectance(cosine_of(40), 1.5) == doctest::Approx(fresnel_reflectance(inside, 1 / 1.5)));
}

TEST_CASE("scattering: beyond the critical angle all light is reflected") {
  const double critical = std::asin(1 / 1.5) * 180 / std::numbers::pi;
  CHECK(fresnel_reflectance(cosine_of(critical + 0.1), 1 / 1.5) == 1.0);
  CHECK(fresnel_reflectance(cosine_of(critical - 0.1), 1 / 1.5) < 1.0);
  Vec3 out;
  CHECK_FALSE(refracted(glm::normalize(Vec3{1, 0, -0.2}), {0, 0, 1}, 1 / 1.5, out));
}

TEST_CASE("scattering: refraction obeys Snell's law and keeps unit length") {
  const Vec3 in = glm::normalize(Vec3{0.6, 0.1, -0.7});
  Vec3 out;
  REQUIRE(refracted(in, {0, 0, 1}, 1.5, out));
  CHECK(glm::length(out) == doctest::Approx(1.0));
  CHECK(std::hypot(out.x, out.y) * 1.5 == doctest::Approx(std::hypot(in.x, in.y)));
  CHECK(out.z < 0);
}

TEST_CASE("scattering: the Phong lobe reflects Ks at normal incidence") {
  for (const double exponent : {1.0, 20.0, 500.0}) {
    double sum = 0;
    const int count = 20000;
    for (int i = 0; i < count; ++i) {
      const Vec3 d = phong_direction({0, 0, 1}, exponent, r2_point(static_cast<std::uint32_t>(i), {0, 0}));
      sum += phong_weight(d.z, exponent);
    }
    CHECK(sum / count == doctest::Approx(1.0).epsilon(2e-3));
  }
}

TEST_CASE("scattering: diffuse and specular shares never exceed one together") {
  Material material;
  material.finish = Finish::mirror;
  material.specular = Rgb{0.9};
  CHECK(specular_share(material, Rgb{0.5}) == Rgb{0.5});
  CHECK(specular_share(material, Rgb{0.0}) == Rgb{0.9});
  material.finish = Finish::diffuse;
  CHECK(specular_share(material, Rgb{0.0}) == Rgb{0.0});
}
