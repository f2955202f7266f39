#include "io/scene_survey.hpp"

#include <cstdio>
#include <numbers>

namespace lichthof::io {

namespace {

constexpr double large_scene_m = 200;
constexpr double small_scene_m = 0.05;
constexpr double lumens_per_watt = 179;

std::string shown(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.4g", value);
  return text;
}

void survey_light(const Scene& scene, ImportReport& report) {
  std::vector<char> used(scene.materials.size(), 0);
  for (const Surface& surface : scene.surfaces) {
    const Material& material = scene.material_of(surface);
    used[surface.material] = 1;
    report.emitters += material.emits();
    report.power_w += std::numbers::pi * surface.area * material.radiance;
  }
  report.lumens = lumens_per_watt * luminance(report.power_w);
  report.materials = scene.materials.size();
  report.textures = scene.textures.size();
  for (std::size_t i = 0; i < used.size(); ++i)
    if (!used[i]) report.unused_materials.push_back(scene.materials[i].name);
}

}  // namespace

void survey(const Scene& scene, ImportReport& report) {
  survey_light(scene, report);
  if (scene.surfaces.empty()) return;
  const Box box = bounds(scene);
  report.extent = box.size();
  const double largest = max_channel(report.extent);
  if (largest > large_scene_m)
    report.note("size", "the scene is " + shown(largest) + " m across: is its unit mm or cm? (--unit mm)");
  if (largest < small_scene_m)
    report.note("size", "the scene is only " + shown(largest) + " m across: is its unit m? (--unit m)");
}

}  // namespace lichthof::io
