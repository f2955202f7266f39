#include "core/tracing/camera.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "core/base/check.hpp"

namespace lichthof {

namespace {

constexpr double degree = std::numbers::pi / 180;
/// A side is open when at least this share of the rays through it ends inside; the rest may meet its frame.
constexpr double open_share = 0.9;
/// Furniture nearer than this, in sizes of the scene, stands in the way of a view.
constexpr double right_before_eye = 0.06;

/// How good a view is: the median distance (m) of its rays, where a ray that meets nothing goes 0 m.
struct ViewQuality {
  double median_distance = 0;
  double met_share = 0;   ///< of the rays
  double near_share = 0;  ///< of the rays, those that end right before the eye
};

/// @param beyond  distances count from this plane on (for an eye outside); normal points into the scene
ViewQuality quality_of(const TraceScene& scene, const Camera& camera, double aspect, const Vec3* entry,
                       const Vec3& inward) {
  constexpr std::uint32_t columns = 12, rows = 9;
  // Square pixels of a real film, sampled coarsely.
  const std::uint32_t height = 900;
  const PinholeCamera film(camera, static_cast<std::uint32_t>(std::clamp(height * aspect, 1.0, 9e6)), height);
  std::vector<double> distances;
  int met = 0, near = 0;
  for (std::uint32_t i = 0; i < columns * rows; ++i) {
    const Vec3 direction =
        film.direction({(i % columns + 0.5) * film.width() / columns, (i / columns + 0.5) * film.height() / rows});
    const auto hit = scene.rays().nearest(camera.eye, direction);
    double distance = hit ? hit->distance : 0.0;
    if (hit && entry) distance -= std::max(0.0, glm::dot(*entry - camera.eye, inward) / glm::dot(direction, inward));
    met += hit && (!entry || distance > 1e-3 * scene.size());
    near += hit && distance < right_before_eye * scene.size();
    distances.push_back(std::max(distance, 0.0));
  }
  std::nth_element(distances.begin(), distances.begin() + distances.size() / 2, distances.end());
  constexpr double all = columns * rows;
  return {distances[distances.size() / 2], met / all, near / all};
}

}  // namespace

PinholeCamera::PinholeCamera(const Camera& camera, std::uint32_t width, std::uint32_t height)
    : width_(width), height_(height), eye_(camera.eye), forward_(glm::normalize(camera.target - camera.eye)) {
  MUST(width >= 1 && height >= 1);
  const double pixel = 2.0 * std::tan(0.5 * camera.vertical_fov_deg * degree) / height;
  across_ = pixel * glm::normalize(glm::cross(forward_, camera.up));
  upwards_ = pixel * glm::normalize(glm::cross(across_, forward_));
}

Expected<Camera> checked(const Camera& camera) {
  const auto bad = [](const char* message) { return Error{ErrorCode::bad_input, "camera", message}; };
  if (!all_finite(camera.eye) || !all_finite(camera.target) || !all_finite(camera.up) ||
      !std::isfinite(camera.vertical_fov_deg))
    return bad("a coordinate is not a finite number");
  if (!(camera.vertical_fov_deg > 0 && camera.vertical_fov_deg < 180))
    return bad("the vertical field of view must lie between 0 and 180 degrees");
  const Vec3 view = camera.target - camera.eye;
  const double distance = glm::length(view);
  if (!(distance > 1e-12 * std::max(1.0, glm::length(camera.eye))))
    return bad("eye and target are the same point; move the target to where the camera should look");
  Camera usable = camera;
  const Vec3 forward = view / distance;
  const double up_length = glm::length(camera.up);
  if (!(up_length > 0) || glm::length(glm::cross(forward, camera.up / up_length)) < 1e-6)
    usable.up = std::abs(forward.z) < 0.9 ? Vec3{0, 0, 1} : Vec3{0, 1, 0};
  return usable;
}

Status standing_free(const Camera& camera, const TraceScene& scene) {
  double nearest = 1e300, farthest = 0;
  bool enclosed = true;
  // Directions spread evenly over the sphere (Fibonacci spiral).
  constexpr int directions = 256;
  for (int i = 0; i < directions; ++i) {
    const double z = 1.0 - (2.0 * i + 1.0) / directions, radius = std::sqrt(1.0 - z * z);
    const double angle = std::numbers::pi * (3.0 - std::sqrt(5.0)) * i;
    const auto hit = scene.rays().nearest(camera.eye, {radius * std::cos(angle), radius * std::sin(angle), z});
    if (!hit) {
      enclosed = false;
      continue;
    }
    nearest = std::min(nearest, hit->distance);
    farthest = std::max(farthest, hit->distance);
  }
  // The rays may pass a very close surface by a hair; its own plane tells.
  for (const Surface& surface : scene.scene().surfaces) {
    const double height = glm::dot(camera.eye - surface.corners[0], surface.normal);
    if (std::abs(height) > 1e-6 * scene.size()) continue;
    bool inside = true;
    for (std::size_t k = 0; k < surface.corners.size() && inside; ++k) {
      const Vec3 edge = surface.corners[(k + 1) % surface.corners.size()] - surface.corners[k];
      inside = glm::dot(glm::cross(surface.normal, edge), camera.eye - surface.corners[k]) >= 0;
    }
    if (inside) nearest = std::min(nearest, std::abs(height));
  }
  if (nearest <= 1e-6 * scene.size())
    return Error{ErrorCode::bad_input, "camera", "the eye lies on a surface of the scene; move it into the open"};
  if (enclosed && farthest < 1e-3 * scene.size())
    return Error{ErrorCode::bad_input, "camera",
                 "the eye is inside a wall: every view ends at once; move it into the open"};
  return Done{};
}

Camera framing_camera(const TraceScene& scene, double aspect) {
  const Box box = bounds(scene.scene());
  const Vec3 size = box.size(), middle = box.centre();
  Camera best;
  best.name = "automatic";
  double best_score = -1;
  const auto consider = [&](const Vec3& eye, const Vec3& target, double preference) {
    Camera candidate{"automatic", eye, target, {0, 0, 1}, 60};
    if (const auto usable = checked(candidate))
      candidate = *usable;
    else
      return;
    const ViewQuality quality = quality_of(scene, candidate, aspect, nullptr, {});
    const double score = preference * quality.met_share * quality.median_distance * (1 - quality.near_share);
    if (score > best_score) best_score = score, best = candidate;
  };

  // Inside: a lattice over the floor plan, eyes at 45 % of the height, looking towards the middle and along the axes.
  for (const auto& [height, preference] : {std::pair{0.45, 1.0}, std::pair{0.2, 0.8}, std::pair{0.75, 0.7}}) {
    for (int i = 0; i < 5; ++i)
      for (int j = 0; j < 5; ++j) {
        const Vec3 eye = box.lo + size * Vec3{0.06 + 0.22 * i, 0.06 + 0.22 * j, height};
        const Vec3 centre{middle.x, middle.y, box.lo.z + 0.4 * size.z};
        if (i != 2 || j != 2) consider(eye, centre, preference);
        for (int side = 0; side < 4; ++side) {
          const double angle = 0.5 * std::numbers::pi * side;
          consider(eye, eye + scene.size() * Vec3{std::cos(angle), std::sin(angle), -0.05}, 0.8 * preference);
        }
      }
    if (best_score > 0.15 * scene.size()) break;
  }

  // In front of an open side: a doll's house is best seen whole, so this goes before any place inside. The opening fills
  // the film, and nearly every ray enters.
  const double half_height = std::tan(30 * degree);
  double deepest = 0.05 * scene.size();
  for (int axis = 0; axis < 2; ++axis)
    for (const double sign : {-1.0, 1.0}) {
      Vec3 inward{0.0};
      inward[axis] = -sign;
      Vec3 opening = middle;
      opening[axis] = sign > 0 ? box.hi[axis] : box.lo[axis];
      const double distance = std::max(0.5 * size.z, 0.5 * size[1 - axis] / aspect) / half_height * 1.02;
      const Camera candidate{"automatic", opening - distance * inward, middle, {0, 0, 1}, 60};
      if (!checked(candidate)) continue;
      const ViewQuality quality = quality_of(scene, candidate, aspect, &opening, inward);
      if (quality.met_share >= open_share && quality.median_distance > deepest) {
        deepest = quality.median_distance;
        best = candidate;
        best_score = std::max(best_score, deepest);
      }
    }

  // Nothing to stand in (a model on a plane, say): three-quarter view of the whole from outside.
  if (best_score < 0.02 * scene.size()) {
    const double distance = 0.5 * scene.size() / std::sin(30 * degree) / std::min(1.0, aspect);
    best.eye = middle + distance * glm::normalize(Vec3{-0.6, -1.0, 0.55});
    best.target = middle;
  }
  return best;
}

}  // namespace lichthof
