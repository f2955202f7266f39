/// The pinhole camera: rays of a column; a camera that frames a scene by itself; what is wrong with one a user gave.
#pragma once

#include <cstdint>

#include "core/base/expected.hpp"
#include "core/tracing/trace_scene.hpp"

namespace lichthof {

/// A camera at a resolution. Pixels are square; column 0 is left, row 0 is on top.
class PinholeCamera {
 public:
  /// @pre checked(camera) succeeded; width, height ≥ 1
  PinholeCamera(const Camera& camera, std::uint32_t width, std::uint32_t height);

  std::uint32_t width() const { return width_; }
  std::uint32_t height() const { return height_; }
  const Vec3& eye() const { return eye_; }
  /// Unit direction through a point of the film, in pixels from its upper left corner.
  Vec3 direction(const Vec2& film) const {
    return glm::normalize(forward_ + (film.x - 0.5 * width_) * across_ - (film.y - 0.5 * height_) * upwards_);
  }

 private:
  std::uint32_t width_, height_;
  Vec3 eye_, forward_, across_, upwards_;  ///< across_, upwards_: one pixel at distance 1
};

/// The camera itself, with an `up` that is not parallel to the view.
/// @error bad_input when a number is not finite, eye and target coincide, or the field of view is not in (0, 180)
Expected<Camera> checked(const Camera& camera);

/// @error bad_input when the eye stands in a wall: within 1e-6 of the scene's size of a surface, or so enclosed that every
/// ray ends within 1e-3 of it
Status standing_free(const Camera& camera, const TraceScene& scene);

/// A camera that shows the scene's interior: the best of a set of places inside the bounding box and in front of its open
/// sides, by the median distance its rays travel; rays that meet nothing count as none.
/// @param aspect  width / height
/// @cost about 200 candidates of 12 x 9 rays: some 20 ms
Camera framing_camera(const TraceScene& scene, double aspect);

}  // namespace lichthof
