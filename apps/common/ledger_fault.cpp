#include "apps/common/ledger_fault.hpp"

#include <cmath>
#include <cstdio>
#include <optional>

#include "core/tracing/trace_scene.hpp"

namespace lichthof::apps {

namespace {

/// Shares of the emitted energy. Sound rooms of a few hundred elements lose up to .02 of it, and never gain.
constexpr double most_lost = 0.03, most_gained = 0.01, most_surplus = 1e-3;
/// A luminaire nearer to a surface than this share of its width shines on less than a patch there.
constexpr double close_luminaire = 0.5;

std::string shown(const char* format, double value) {
  char text[64];
  std::snprintf(text, sizeof text, format, value);
  return text;
}

/// Distance (m) from a surface's middle to what stands in front of it.
std::optional<double> room_before(const TraceScene& trace, const Vec3& middle, const Vec3& normal) {
  const auto met = trace.nearest(middle + trace.offset() * normal, normal);
  return met ? std::optional(glm::length(met->point - middle)) : std::nullopt;
}

std::string close_luminaire_of(const TraceScene& trace) {
  const Scene& scene = trace.scene();
  for (const Surface& surface : scene.surfaces) {
    if (!scene.material_of(surface).emits()) continue;
    const double width = std::sqrt(surface.area);
    const auto distance = room_before(trace, centroid(std::span<const Vec3>(surface.corners)), surface.normal);
    if (distance && *distance < close_luminaire * width)
      return "a lamp of " + shown("%.3g m", width) + " shines on a surface " + shown("%.3g m", *distance) +
             " away (face " + std::to_string(surface.source_face) +
             " of the scene); smaller elements there (--elements, --element) help";
  }
  return {};
}

std::string close_surfaces_of(const TraceScene& trace, const Mesh& mesh) {
  for (const Patch& patch : mesh.patches) {
    if (!mesh.group_is_lit[patch.group.value]) continue;
    const Surface& surface = trace.scene().surfaces[patch.surface.value];
    const Vec3 normal = patch.back ? -surface.normal : surface.normal;
    const auto distance = room_before(trace, patch.centre, normal);
    if (distance && *distance < 0.5 * mesh.options.element_size)
      return "faces stand " + shown("%.2g m", *distance) + " apart or in each other (face " +
             std::to_string(surface.source_face) + " of the scene), nearer than an element is wide";
  }
  return "elements may be too large (--elements)";
}

}  // namespace

std::string ledger_fault(const Solution& solution) {
  const EnergyLedger& energy = solution.energy;
  if (!(energy.emitted > 0)) return {};
  const double residual = energy.residual(), surplus = energy.absorbed / energy.emitted - 1;
  if (residual <= most_lost && residual >= -most_gained && surplus <= most_surplus) return {};
  const TraceScene trace(solution.scene);
  std::string cause = close_luminaire_of(trace);
  if (cause.empty() && !solution.converged) cause = "it was stopped early";
  if (cause.empty()) cause = close_surfaces_of(trace, *solution.mesh);
  return "the energy of the first pass does not add up: " + shown("%.3g %%", 100 * (1 + surplus)) +
         " absorbed, residual " + shown("%.2g", residual) + "; " + cause;
}

}  // namespace lichthof::apps
