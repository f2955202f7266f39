#include "io/element_polygons.hpp"

#include <array>
#include <cmath>
#include <map>
#include <unordered_map>

#include "core/scene/polygon.hpp"
#include "io/bytes.hpp"

namespace lichthof::io {

namespace {

/// A place in a plane, or a place in a plane as one material sees it.
struct Key {
  std::int64_t x = 0, y = 0;
  std::uint32_t plane = 0, material = 0;
  bool operator==(const Key&) const = default;
};
struct KeyHash {
  std::size_t operator()(const Key& key) const { return checksum({reinterpret_cast<const char*>(&key), sizeof key}); }
};
static_assert(sizeof(Key) == 24, "no padding: the bytes are hashed");

struct Mean {
  Rgb irradiance{0.0};
  Rgb reflectance{0.0}, exitance{0.0};
  double count = 0;
};

class ModelMaker {
 public:
  explicit ModelMaker(const Solution& solution) : solution_(solution), mesh_(*solution.mesh) {
    const Vec3 size = bounds(*solution.scene).size();
    step_ = 1e-7 * std::max(max_channel(size), 1e-9);
  }
  ElementModel make();

 private:
  Key key_of(const Patch& patch, const Vec2& corner) const {
    const std::uint32_t material = solution_.scene->surfaces[patch.surface.value].material;
    return {std::llround(corner.x / step_), std::llround(corner.y / step_), patch.plane.value, material};
  }
  void add_element(const Patch& patch, std::size_t element);
  std::uint32_t vertex(const Patch& patch, const Vec2& corner, const Rgb& irradiance);
  void finish();

  const Solution& solution_;
  const Mesh& mesh_;
  double step_;
  ElementModel model_;
  std::unordered_map<Key, std::uint32_t, KeyHash> vertices_;
  std::unordered_map<Key, Mean, KeyHash> light_;  ///< by place in the plane, whatever the material
  std::vector<Key> keys_;                         ///< of each vertex
  std::vector<Mean> surfaces_;                    ///< of each vertex: mean reflectance and exitance around it
};

std::uint32_t ModelMaker::vertex(const Patch& patch, const Vec2& corner, const Rgb& irradiance) {
  Key key = key_of(patch, corner);
  const auto [entry, is_new] = vertices_.try_emplace(key, static_cast<std::uint32_t>(model_.vertices.size()));
  if (is_new) {
    const Plane& plane = mesh_.planes[patch.plane.value];
    model_.vertices.push_back({plane.point(corner), plane.normal, Rgb{0.0}});
    keys_.push_back(key);
    surfaces_.emplace_back();
  }
  Mean& surface = surfaces_[entry->second];
  surface.reflectance += patch.reflectance, surface.exitance += patch.exitance, surface.count += 1;
  // Light does not stop where the paint changes.
  key.material = 0;
  Mean& light = light_[key];
  light.irradiance += irradiance, light.count += 1;
  return entry->second;
}

void ModelMaker::add_element(const Patch& patch, std::size_t element) {
  const Polygon2 polygon = mesh_.element_polygon(patch, mesh_.elements[element]);
  if (polygon.size() < 3) return;
  const Rgb irradiance = solution_.total(element);
  ElementModel::Face face{static_cast<std::uint32_t>(model_.corners.size()), 0,
                          solution_.scene->surfaces[patch.surface.value].material};
  for (const Vec2& corner : polygon) {
    const std::uint32_t index = vertex(patch, corner, irradiance);
    // Corners closer than the step fall together.
    if (face.count > 0 && (model_.corners.back() == index || model_.corners[face.first] == index)) continue;
    model_.corners.push_back(index);
    ++face.count;
  }
  if (face.count >= 3)
    model_.faces.push_back(face);
  else
    model_.corners.resize(face.first);
}

void ModelMaker::finish() {
  for (std::size_t i = 0; i < model_.vertices.size(); ++i) {
    Key place = keys_[i];
    place.material = 0;
    const Mean &light = light_[place], &surface = surfaces_[i];
    model_.vertices[i].radiosity =
        (surface.exitance + surface.reflectance * (light.irradiance / light.count)) / surface.count;
  }
}

ElementModel ModelMaker::make() {
  for (const Patch& patch : mesh_.patches)
    for (std::size_t e = patch.first_element; e < patch.first_element + patch.element_count; ++e) add_element(patch, e);
  finish();
  return std::move(model_);
}

}  // namespace

Rgb element_radiosity(const Solution& solution, const Patch& patch, std::size_t element) {
  return patch.exitance + patch.reflectance * solution.total(element);
}

ElementModel element_model(const Solution& solution) { return ModelMaker(solution).make(); }

}  // namespace lichthof::io
