#include "io/scene_bytes.hpp"

#include <algorithm>
#include <cmath>

#include "io/bytes.hpp"
#include "io/mtl_reader.hpp"
#include "io/text.hpp"

namespace lichthof::io {

namespace {

// Writer and reader list the same fields in the same order; keep them side by side.

void put_material(ByteWriter& to, const Material& m) {
  to.put(m.name), to.put(m.reflectance), to.put(m.radiance), to.put(m.specular), to.put(m.exponent),
      to.put(m.refractive_index);
  to.put(static_cast<std::uint8_t>(m.finish));
  to.put(m.texture ? *m.texture : 0xffffffffu);
}

void get_material(ByteReader& from, Material& m) {
  std::uint8_t finish = 0;
  std::uint32_t texture = 0xffffffffu;
  from.get(m.name), from.get(m.reflectance), from.get(m.radiance), from.get(m.specular), from.get(m.exponent),
      from.get(m.refractive_index);
  from.get(finish), from.get(texture);
  m.finish = static_cast<Finish>(std::min<std::uint8_t>(finish, 3));
  if (texture != 0xffffffffu) m.texture = texture;
}

void put_surface(ByteWriter& to, const Surface& s) {
  to.put(s.corners), to.put(s.texcoords), to.put(s.normal), to.put(s.area), to.put(s.material), to.put(s.source_face);
}

void get_surface(ByteReader& from, Surface& s) {
  from.get(s.corners), from.get(s.texcoords), from.get(s.normal), from.get(s.area), from.get(s.material),
      from.get(s.source_face);
}

void put_camera(ByteWriter& to, const Camera& c) {
  to.put(c.name), to.put(c.eye), to.put(c.target), to.put(c.up), to.put(c.vertical_fov_deg);
}

void get_camera(ByteReader& from, Camera& c) {
  from.get(c.name), from.get(c.eye), from.get(c.target), from.get(c.up), from.get(c.vertical_fov_deg);
}

bool sound(const Material& m, const Scene& scene) {
  return is_valid_colour(m.reflectance) && max_channel(m.reflectance) < 1 && is_valid_colour(m.radiance) &&
         is_valid_colour(m.specular) && std::isfinite(m.exponent) && m.exponent >= 0 &&
         std::isfinite(m.refractive_index) && m.refractive_index >= 1 &&
         (!m.texture || *m.texture < scene.textures.size());
}

bool sound(const Surface& s, const Scene& scene) {
  constexpr double largest_coordinate = 1e15;
  if (s.corners.size() < 3 || s.material >= scene.materials.size()) return false;
  if (!s.texcoords.empty() && s.texcoords.size() != s.corners.size()) return false;
  for (const Vec3& corner : s.corners)
    if (!all_finite(corner) ||
        std::max({std::abs(corner.x), std::abs(corner.y), std::abs(corner.z)}) > largest_coordinate)
      return false;
  for (const Vec2& texcoord : s.texcoords)
    if (!std::isfinite(texcoord.x) || !std::isfinite(texcoord.y)) return false;
  return std::isfinite(s.area) && s.area > 0 && all_finite(s.normal) && std::abs(glm::length(s.normal) - 1) < 1e-6;
}

/// Name and number, from 1, of the first material or surface that can't be; empty when all can.
std::string unsound_part(const Scene& scene) {
  const auto first = [&scene](const auto& parts) {
    return std::find_if(parts.begin(), parts.end(), [&scene](const auto& part) { return !sound(part, scene); }) -
           parts.begin();
  };
  if (const auto m = first(scene.materials); m < std::ssize(scene.materials))
    return "material " + std::to_string(m + 1);
  if (const auto s = first(scene.surfaces); s < std::ssize(scene.surfaces)) return "surface " + std::to_string(s + 1);
  return {};
}

bool sound(const Scene& scene) {
  return !scene.surfaces.empty() && scene.file_frame.metres_per_unit > 0 &&
         std::isfinite(scene.file_frame.metres_per_unit) &&
         (!scene.patch_size || (std::isfinite(*scene.patch_size) && *scene.patch_size > 0)) &&
         (!scene.element_size || (std::isfinite(*scene.element_size) && *scene.element_size > 0)) &&
         std::all_of(scene.cameras.begin(), scene.cameras.end(), [](const Camera& c) {
           return all_finite(c.eye) && all_finite(c.target) && all_finite(c.up) && std::isfinite(c.vertical_fov_deg);
         });
}

bool get_textures(ByteReader& from, Scene& scene) {
  for (Texture& texture : scene.textures) {
    from.get(texture.rgb);
    if (texture.width == 0 || texture.height == 0 || texture.rgb.size() / 3 / texture.width != texture.height ||
        texture.rgb.size() != std::size_t{3} * texture.width * texture.height)
      return false;
    for (const float value : texture.rgb)
      if (!(value >= 0 && value <= 1)) return false;
  }
  return from.good() && from.at_end();
}

}  // namespace

std::string scene_bytes(const Scene& scene) {
  ByteWriter to;
  to.put(scene.file_frame.metres_per_unit);
  to.put(static_cast<std::uint8_t>(scene.file_frame.y_up));
  to.put(scene.patch_size.value_or(0.0)), to.put(scene.element_size.value_or(0.0));
  to.put(static_cast<std::uint64_t>(scene.textures.size()));
  for (const Texture& texture : scene.textures) to.put(texture.name), to.put(texture.width), to.put(texture.height);
  to.put(static_cast<std::uint64_t>(scene.materials.size()));
  for (const Material& material : scene.materials) put_material(to, material);
  to.put(static_cast<std::uint64_t>(scene.cameras.size()));
  for (const Camera& camera : scene.cameras) put_camera(to, camera);
  to.put(static_cast<std::uint64_t>(scene.surfaces.size()));
  for (const Surface& surface : scene.surfaces) put_surface(to, surface);
  return to.bytes();
}

std::string texture_bytes(const Scene& scene) {
  ByteWriter to;
  for (const Texture& texture : scene.textures) to.put(texture.rgb);
  return to.bytes();
}

Expected<Scene> scene_from(std::string_view bytes, std::string_view texture_pixels, const std::string& where) {
  Scene scene;
  ByteReader from(bytes);
  double patch_size = 0, element_size = 0;
  from.get(scene.file_frame.metres_per_unit), from.get(scene.file_frame.y_up), from.get(patch_size);
  from.get(element_size);
  if (patch_size != 0) scene.patch_size = patch_size;
  if (element_size != 0) scene.element_size = element_size;
  // The least bytes of one thing each: a name's length and the fixed fields.
  scene.textures.resize(from.count(16));
  for (Texture& texture : scene.textures) from.get(texture.name), from.get(texture.width), from.get(texture.height);
  scene.materials.resize(from.count(100));
  for (Material& material : scene.materials) get_material(from, material);
  scene.cameras.resize(from.count(88));
  for (Camera& camera : scene.cameras) get_camera(from, camera);
  scene.surfaces.resize(from.count(56));
  for (Surface& surface : scene.surfaces) get_surface(from, surface);
  if (!from.good() || !from.at_end()) return bad_input(where, "is damaged: its scene cannot be read");
  ByteReader pixels(texture_pixels);
  if (!get_textures(pixels, scene)) return bad_input(where, "is damaged: its textures cannot be read");
  if (const std::string part = unsound_part(scene); !part.empty())
    return bad_input(where, "is damaged: " + part + " of its scene makes no sense");
  if (!sound(scene)) return bad_input(where, "is damaged: its scene makes no sense");
  return scene;
}

namespace {
constexpr std::string_view parcel_mark = "lichthof scene 1";
}

std::string scene_parcel(const Scene& scene) {
  std::string parcel(parcel_mark);
  const std::string body = scene_bytes(scene);
  const auto length = static_cast<std::uint64_t>(body.size());
  parcel.append(reinterpret_cast<const char*>(&length), sizeof length);
  return parcel + body + texture_bytes(scene);
}

Expected<Scene> scene_from_parcel(std::string_view parcel, const std::string& where) {
  std::uint64_t length = 0;
  const std::size_t head = parcel_mark.size() + sizeof length;
  if (parcel.size() < head || !parcel.starts_with(parcel_mark)) return bad_input(where, "is no scene of lichthof");
  std::memcpy(&length, parcel.data() + parcel_mark.size(), sizeof length);
  parcel.remove_prefix(head);
  if (length > parcel.size()) return bad_input(where, "is damaged: its scene is cut off");
  return scene_from(parcel.substr(0, length), parcel.substr(length), where);
}

}  // namespace lichthof::io
