#include "apps/common/camera_choice.hpp"

#include <algorithm>
#include <cmath>
#include <string_view>
#include <vector>

#include "io/text.hpp"

namespace lichthof::apps {

namespace {

constexpr const char* expected_form =
    "\"EYE; TARGET; UP; FOV\" was expected, for example \"1,2,1.7; 5,5,1; 0,0,1; 60\"";

Error wrong(const std::string& what) { return {ErrorCode::bad_input, "--camera", what + "; " + expected_form}; }

std::vector<std::string_view> split(std::string_view text, char separator) {
  std::vector<std::string_view> parts;
  for (;;) {
    const std::size_t end = text.find(separator);
    parts.push_back(io::trimmed(text.substr(0, end)));
    if (end == std::string_view::npos) return parts;
    text.remove_prefix(end + 1);
  }
}

Expected<Vec3> vector_from(std::string_view text, const char* name) {
  const std::vector<std::string_view> parts = split(text, ',');
  Vec3 vector{0.0};
  bool good = parts.size() == 3;
  for (int i = 0; i < 3 && good; ++i)
    good = io::parse_number(parts[static_cast<std::size_t>(i)], vector[i]) && std::abs(vector[i]) <= 1e9;
  if (!good) return wrong(std::string(name) + " " + io::in_quotes(text) + " is not three numbers");
  return vector;
}

/// The camera itself once it is usable; `name` is put before what is wrong with it.
Expected<Camera> placed(const Camera& camera, const std::string& name, const TraceScene& scene) {
  Expected<Camera> usable = checked(camera);
  if (!usable) return Error{ErrorCode::bad_input, name, usable.error().message};
  if (const Status free = standing_free(*usable, scene); !free)
    return Error{ErrorCode::bad_input, name, free.error().message};
  return usable;
}

}  // namespace

Expected<Camera> camera_from(const std::string& text, const FileFrame& frame) {
  const std::vector<std::string_view> parts = split(text, ';');
  if (parts.size() < 2 || parts.size() > 4)
    return wrong(io::in_quotes(text) + " has " + std::to_string(parts.size()) + " parts");
  const Expected<Vec3> eye = vector_from(parts[0], "EYE"), target = vector_from(parts[1], "TARGET");
  if (!eye) return eye.error();
  if (!target) return target.error();
  Camera camera;
  camera.name = "as given";
  camera.eye = frame.point_to_world(*eye);
  camera.target = frame.point_to_world(*target);
  if (parts.size() > 2) {
    const Expected<Vec3> up = vector_from(parts[2], "UP");
    if (!up) return up.error();
    if (glm::length(*up) == 0) return wrong("UP has no length");
    camera.up = frame.direction_to_world(*up);
  }
  if (parts.size() > 3 && !io::parse_number(parts[3], camera.vertical_fov_deg))
    return wrong("FOV " + io::in_quotes(parts[3]) + " is no number");
  return camera;
}

Expected<Camera> chosen_camera(const std::optional<std::string>& wish, const TraceScene& scene, const FileFrame& frame,
                               double aspect) {
  const std::vector<Camera>& cameras = scene.scene().cameras;
  if (!wish && cameras.empty()) return framing_camera(scene, aspect);
  if (!wish) return placed(cameras.front(), "camera " + io::in_quotes(cameras.front().name), scene);
  if (wish->find(';') != std::string::npos) {
    const Expected<Camera> camera = camera_from(*wish, frame);
    return camera ? placed(*camera, "--camera", scene) : camera;
  }
  const auto named =
      std::find_if(cameras.begin(), cameras.end(), [&](const Camera& camera) { return camera.name == *wish; });
  if (named != cameras.end()) return placed(*named, "camera " + io::in_quotes(named->name), scene);
  std::string names;
  for (const Camera& camera : cameras) names += (names.empty() ? "" : ", ") + camera.name;
  return wrong(io::in_quotes(*wish) + " is no camera of the scene (" + (names.empty() ? "it has none" : names) + ")");
}

}  // namespace lichthof::apps
