/// A whole scene as bytes, for solution files and for sending: reads back bit for bit, so that the same mesh follows from it.
#pragma once

#include <string>
#include <string_view>

#include "core/base/expected.hpp"
#include "core/scene/scene.hpp"

namespace lichthof::io {

/// Everything but the textures' pixels.
std::string scene_bytes(const Scene& scene);
/// The pixels of all textures.
std::string texture_bytes(const Scene& scene);

/// Both in one piece, for sending: a mark, the length of the scene's bytes, then those and the pixels.
std::string scene_parcel(const Scene& scene);

/// @param where  file name, for messages
/// @error bad_input: the bytes are no scene, or one that breaks what Scene promises (finite, indices in range, areas > 0)
Expected<Scene> scene_from(std::string_view scene, std::string_view textures, const std::string& where);
Expected<Scene> scene_from_parcel(std::string_view parcel, const std::string& where);

}  // namespace lichthof::io
