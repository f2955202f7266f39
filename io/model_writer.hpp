/// Solutions as models for other programs; the ending of the name chooses the format.
///
/// `.csv`  one row an element: centre and normal (the scene's own unit and axes), area (m²), irradiance and radiosity
///         (W/m²), material. As exact as the solution.
/// `.ply`  binary; polygons with a colour for the eye (tone mapped sRGB, 8 bit) and the radiosity (float, W/m²) at their
///         corners; the scene's own unit and axes.
/// `.glb`  glTF 2.0: triangles in metres, y up; COLOR_0 is what a screen should emit (tone mapped, linear, 16 bit), shown
///         unlit (KHR_materials_unlit); _RADIOSITY holds the radiosity (W/m²). One primitive a material.
#pragma once

#include <string>

#include "core/base/expected.hpp"
#include "core/light/solution.hpp"
#include "io/image_writer.hpp"

namespace lichthof::io {

/// @param tone  how radiosity / π becomes a colour; without an exposure the log-average of the corners is its middle grey
/// @pre   scene, mesh and irradiance are set
/// @error bad_input: another ending; io; failed: too large for the format (glb: 4 GiB). Nothing half-written stays behind
Status write_model(const std::string& path, const Solution& solution, const ToneMapping& tone = {});

}  // namespace lichthof::io
