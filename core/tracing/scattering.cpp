#include "core/tracing/scattering.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/base/random.hpp"

namespace lichthof {

namespace {

/// Reflectances for both polarisations; false on total reflection.
bool interface_reflectances(double cosine, double eta, double& perpendicular, double& parallel) {
  const double sine2 = (1.0 - cosine * cosine) / (eta * eta);
  if (sine2 >= 1.0) return false;
  const double inside = std::sqrt(1.0 - sine2);
  const double s = (cosine - eta * inside) / (cosine + eta * inside);
  const double p = (eta * cosine - inside) / (eta * cosine + inside);
  perpendicular = s * s;
  parallel = p * p;
  return true;
}

}  // namespace

double fresnel_reflectance(double cosine, double eta) {
  double s, p;
  return interface_reflectances(std::clamp(cosine, 0.0, 1.0), eta, s, p) ? 0.5 * (s + p) : 1.0;
}

double pane_reflectance(double cosine, double refractive_index) {
  double s, p;
  if (!interface_reflectances(std::clamp(cosine, 0.0, 1.0), refractive_index, s, p)) return 1.0;
  return s / (1.0 + s) + p / (1.0 + p);
}

bool refracted(const Vec3& direction, const Vec3& normal, double eta, Vec3& out) {
  const double cosine = -glm::dot(direction, normal);
  const double sine2 = (1.0 - cosine * cosine) / (eta * eta);
  if (sine2 >= 1.0) return false;
  out = direction / eta + (cosine / eta - std::sqrt(1.0 - sine2)) * normal;
  return true;
}

Rgb specular_share(const Material& material, const Rgb& diffuse) {
  if (material.finish != Finish::glossy && material.finish != Finish::mirror) return Rgb{0.0};
  return glm::max(glm::min(material.specular, Rgb{1.0} - diffuse), Rgb{0.0});
}

bool is_specular(const Material& material) { return max_channel(specular_share(material, material.reflectance)) > 0; }

Vec3 phong_direction(const Vec3& axis, double exponent, const Vec2& square) {
  const double cosine = std::pow(1.0 - square.x, 1.0 / (exponent + 1.0));
  const double sine = std::sqrt(std::max(0.0, 1.0 - cosine * cosine));
  const double angle = 2.0 * std::numbers::pi * square.y;
  Vec3 tangent, bitangent;
  complete_frame(axis, tangent, bitangent);
  return sine * std::cos(angle) * tangent + sine * std::sin(angle) * bitangent + cosine * axis;
}

double phong_density(double cosine, double exponent) {
  return cosine > 0 ? (exponent + 1.0) / (2.0 * std::numbers::pi) * std::pow(cosine, exponent) : 0.0;
}

double phong_weight(double cosine_to_normal, double exponent) {
  // (n+2)/(n+1) cosθ exceeds 1 by up to 1/(n+1) close to the normal; the mean over the lobe stays below 1.
  return (exponent + 2.0) / (exponent + 1.0) * std::max(0.0, cosine_to_normal);
}

}  // namespace lichthof
