#include "core/scene/scene.hpp"

#include <algorithm>
#include <cmath>

namespace lichthof {

Rgb Texture::sample(const Vec2& texcoord) const {
  const auto wrapped = [](double x, std::uint32_t size) {
    const double y = (x - std::floor(x)) * size - 0.5;
    return y < 0 ? y + size : y;
  };
  const double x = wrapped(texcoord.x, width), y = wrapped(1.0 - texcoord.y, height);
  const auto x0 = std::min(static_cast<std::uint32_t>(x), width - 1), y0 = std::min(static_cast<std::uint32_t>(y), height - 1);
  const std::uint32_t x1 = (x0 + 1) % width, y1 = (y0 + 1) % height;
  const double fx = x - x0, fy = y - y0;
  const auto texel = [&](std::uint32_t column, std::uint32_t row) {
    const float* t = rgb.data() + 3 * (std::size_t{row} * width + column);
    return Rgb{t[0], t[1], t[2]};
  };
  return (1 - fy) * ((1 - fx) * texel(x0, y0) + fx * texel(x1, y0)) + fy * ((1 - fx) * texel(x0, y1) + fx * texel(x1, y1));
}

Box bounds(const Scene& scene) {
  Box box;
  for (const Surface& surface : scene.surfaces)
    for (const Vec3& corner : surface.corners) box.include(corner);
  return box;
}

Vec3 point_of(const Surface& surface, const Vec2& square) {
  double pick = square.x * surface.area;
  for (std::size_t k = 2; k < surface.corners.size(); ++k) {
    const Vec3 a = surface.corners[k - 1] - surface.corners[0], b = surface.corners[k] - surface.corners[0];
    const double part = 0.5 * glm::length(glm::cross(a, b));
    if (pick <= part || k + 1 == surface.corners.size()) {
      const double s = std::sqrt(std::clamp(pick / part, 0.0, 1.0));
      return surface.corners[0] + s * ((1 - square.y) * a + square.y * b);
    }
    pick -= part;
  }
  return surface.corners[0];
}

Vec2 texcoord_at(const Surface& surface, const Vec3& point) {
  // The triangle of the fan that holds the point, or the one it misses by least.
  Vec2 best{0.0};
  double best_defect = 1e300;
  for (std::size_t k = 2; k < surface.corners.size(); ++k) {
    const Vec3 e1 = surface.corners[k - 1] - surface.corners[0], e2 = surface.corners[k] - surface.corners[0];
    const Vec3 n = glm::cross(e1, e2);
    const double n2 = glm::dot(n, n);
    if (n2 == 0) continue;
    const Vec3 d = point - surface.corners[0];
    const double b1 = glm::dot(glm::cross(d, e2), n) / n2, b2 = glm::dot(glm::cross(e1, d), n) / n2;
    const double defect = std::max({-b1, -b2, b1 + b2 - 1.0, 0.0});
    if (defect < best_defect) {
      best_defect = defect;
      best = (1 - b1 - b2) * surface.texcoords[0] + b1 * surface.texcoords[k - 1] + b2 * surface.texcoords[k];
    }
    if (defect == 0) break;
  }
  return best;
}

Rgb reflectance_at(const Scene& scene, const Surface& surface, const Vec3& point) {
  const Material& material = scene.material_of(surface);
  if (!material.texture || surface.texcoords.empty()) return material.reflectance;
  return material.reflectance * scene.textures[*material.texture].sample(texcoord_at(surface, point));
}

}  // namespace lichthof
