/// Which camera a picture is taken with: numbers on the command line, a name from the scene file, or one that frames the
/// scene.
#pragma once

#include <optional>
#include <string>

#include "core/base/expected.hpp"
#include "core/tracing/camera.hpp"

namespace lichthof::apps {

/// Reads "EYE; TARGET; UP; VERTICAL-FOV-DEGREES", numbers separated by commas, in the frame's unit and axes. UP and the
/// field of view may be left out: then the frame's vertical and 60 degrees.
/// @error bad_input naming --camera
Expected<Camera> camera_from(const std::string& text, const FileFrame& frame);

/// @param wish    numbers (they hold a semicolon), or a name; none: the scene's first camera, else framing_camera()
/// @param aspect  width / height
/// @returns  a camera whose eye stands in the open
/// @error    bad_input naming --camera or the camera; an unknown name is answered with those there are
Expected<Camera> chosen_camera(const std::optional<std::string>& wish, const TraceScene& scene, const FileFrame& frame,
                               double aspect);

}  // namespace lichthof::apps
