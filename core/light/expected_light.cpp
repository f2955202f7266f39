#include "core/light/expected_light.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/base/footprint.hpp"
#include "core/light/solution.hpp"

namespace lichthof {

ExpectedLight::ExpectedLight(const GroupExchange& exchange, const Mesh& mesh, std::span<const std::uint32_t> groups)
    : light_(groups.size()), leaving_(groups.size()) {
  constexpr std::uint32_t none = ~0u;
  std::vector<std::uint32_t> number(mesh.groups.size(), none);
  for (std::uint32_t k = 0; k < groups.size(); ++k) number[groups[k]] = k;
  first_link_.push_back(0);
  for (const std::uint32_t group : groups) {
    for (const GroupExchange::Link& link : exchange.links(group))
      if (number[link.group] != none) links_.push_back({number[link.group], link.area});
    first_link_.push_back(static_cast<std::uint32_t>(links_.size()));
    inverse_area_.push_back(static_cast<float>(1 / mesh.groups[group].area));
  }
}

void ExpectedLight::find(std::span<const Unshot> unshot) {
  constexpr int most_sweeps = 40;
  constexpr float settled = 0.02f;  // of all that is expected: the exchange is not known any better
  const std::size_t count = light_.size();
  const auto leave = [&](std::size_t g) {
    for (int c = 0; c < 3; ++c)
      leaving_[g][static_cast<std::size_t>(c)] =
          (unshot[g].power[c] + std::min(unshot[g].answer[c] * light_[g][static_cast<std::size_t>(c)], 1e30f)) *
          inverse_area_[g];
  };
  for (std::size_t g = 0; g < count; ++g) leave(g);
  for (int sweep = 0; sweep < most_sweeps; ++sweep) {
    float change = 0, all = 0;
    for (std::size_t g = 0; g < count; ++g) {
      std::array<float, 4> sum{};
      for (std::uint32_t k = first_link_[g]; k < first_link_[g + 1]; ++k) {
        const std::array<float, 4>& from = leaving_[links_[k].group];
        for (std::size_t c = 0; c < 4; ++c) sum[c] += links_[k].area * from[c];
      }
      for (std::size_t c = 0; c < 3; ++c) {
        change += std::abs(sum[c] - light_[g][c] / inverse_area_[g]);
        all += std::abs(sum[c]);
        light_[g][c] = sum[c] * inverse_area_[g];
      }
      leave(g);
    }
    if (change <= settled * all) return;
  }
}

std::size_t ExpectedLight::memory_bytes() const {
  return bytes_of_all(first_link_, links_, inverse_area_, light_, leaving_);
}

namespace {
template <class Visit>
void for_each_element(const Mesh& mesh, const Group& group, Visit&& visit) {
  for (std::uint32_t p = group.first_patch; p < group.first_patch + group.patch_count; ++p)
    for (std::uint32_t k = 0; k < mesh.patches[p].element_count; ++k)
      visit(mesh.patches[p], mesh.patches[p].first_element + k);
}

/// Index as Mesh::groups.
std::vector<ExpectedLight::Unshot> unshot_of(const Solution& solution) {
  const Mesh& mesh = *solution.mesh;
  std::vector<ExpectedLight::Unshot> unshot(mesh.groups.size());
  for (std::size_t g = 0; g < unshot.size(); ++g)
    for_each_element(mesh, mesh.groups[g], [&](const Patch& patch, std::uint32_t e) {
      const double area = mesh.elements[e].area;
      const Rgb arrived{solution.irradiance[e]};
      unshot[g].power += Rgbf{area * (patch.exitance + patch.reflectance * arrived - Rgb{solution.shot[e]})};
      unshot[g].answer += Rgbf{area * patch.reflectance};
    });
  return unshot;
}

}  // namespace

void set_pending(Solution& solution, const GroupExchange& exchange) {
  const Mesh& mesh = *solution.mesh;
  std::vector<std::uint32_t> groups(mesh.groups.size());
  std::iota(groups.begin(), groups.end(), 0u);
  ExpectedLight expected(exchange, mesh, groups);
  expected.find(unshot_of(solution));
  for (std::size_t g = 0; g < groups.size(); ++g) {
    Rgb received_w{0.0};
    for_each_element(mesh, mesh.groups[g], [&](const Patch&, std::uint32_t e) {
      received_w += static_cast<double>(mesh.elements[e].area) * Rgb{solution.irradiance[e]};
    });
    const Rgb most = glm::max(received_w / mesh.groups[g].area, Rgb{0.0});
    const Rgbf pending{glm::clamp(expected.irradiance(g), -most, most)};
    for_each_element(mesh, mesh.groups[g], [&](const Patch&, std::uint32_t e) { solution.pending[e] = pending; });
  }
}

}  // namespace lichthof
