/// How a finish scatters: Fresnel's equations for glass, the Phong lobe for gloss. Pure formulas, no scene.
#pragma once

#include "core/base/types.hpp"
#include "core/scene/scene.hpp"

namespace lichthof {

/// Unpolarised Fresnel reflectance of one interface (1).
/// @param cosine  of the angle of incidence, in [0, 1]
/// @param eta     refractive index beyond the interface over the one before it
/// @returns 1 where the ray is totally reflected
double fresnel_reflectance(double cosine, double eta);

/// Reflectance of a clear pane with two parallel faces, all internal reflections summed: mean of 2R/(1+R) over both
/// polarisations. Transmittance is one minus this; n = 1.52 gives .9183 at normal incidence.
double pane_reflectance(double cosine, double refractive_index);

/// Mirror direction. @param direction towards the surface @param normal unit
inline Vec3 mirrored(const Vec3& direction, const Vec3& normal) {
  return direction - 2.0 * glm::dot(direction, normal) * normal;
}

/// Refracted direction (Snell). @param direction unit, towards the surface @param normal unit, against the direction
/// @param eta as in fresnel_reflectance() @returns false on total reflection
bool refracted(const Vec3& direction, const Vec3& normal, double eta, Vec3& out);

/// Specular reflectance a finish really uses (1): Ks, limited so that Kd + Ks ≤ 1 in every channel.
Rgb specular_share(const Material& material, const Rgb& diffuse);
/// True for mirrors and gloss, where the finish leaves them any share.
bool is_specular(const Material& material);
/// A plane mirror that shows something.
inline bool is_mirror(const Material& material) { return material.finish == Finish::mirror && is_specular(material); }

/// Direction of the lobe cosⁿ around `axis` for a point of the unit square; density phong_density().
Vec3 phong_direction(const Vec3& axis, double exponent, const Vec2& square);
/// (n+1)/2π cosⁿ (1/sr)
double phong_density(double cosine, double exponent);
/// Weight of a direction so sampled: f cosθ / density = Ks · (n+2)/(n+1) · cosθ; never above Ks.
/// The lobe is f = Ks (n+2)/2π cosⁿ, which reflects Ks at normal incidence and less at grazing. @source [Lafortune94]
double phong_weight(double cosine_to_normal, double exponent);

}  // namespace lichthof
