#include "core/light/radiosity.hpp"

#include <algorithm>
#include <cmath>

#include "core/base/check.hpp"
#include "core/base/footprint.hpp"

namespace lichthof {

namespace {
/// Of B = E + ρH against S: half an ulp of each of the three, and as much for H itself, which is a sum.
constexpr double single_precision = 4 * 0x1p-24;
}  // namespace

std::vector<std::uint32_t> mesh_groups(const ReceiverTree& tree) {
  std::vector<std::uint32_t> groups;
  for (const GroupPlace& place : tree.groups) groups.push_back(place.mesh_group);
  return groups;
}

Radiosity::Radiosity(const Mesh& mesh, const ReceiverTree& tree, const GroupExchange& exchange)
    : clusters(tree.clusters.size()), patches(tree.patches.size()), mesh_(mesh), tree_(tree), sums_(tree.groups.size()),
      expected_(tree.groups.size()), weight_(tree.groups.size()), area_(tree.groups.size()),
      ahead_(exchange, mesh, mesh_groups(tree)) {
  for (std::size_t p = 0; p < patches.size(); ++p) {
    const Patch& patch = mesh.patches[tree.patches[p].mesh_patch];
    patches[p].reflectance = patch.reflectance;
    patches[p].exitance = patch.exitance;
    // The area that receives: the sum over elements, in the precision they are summed with.
    for (std::uint32_t e = patch.first_element; e < patch.first_element + patch.element_count; ++e)
      patches[p].area += mesh.elements[e].area;
  }
  local_group_of_.assign(mesh.groups.size(), ~0u);
  for (std::uint32_t g = 0; g < tree.groups.size(); ++g) {
    const std::uint32_t mesh_group = tree.groups[g].mesh_group;
    local_group_of_[mesh_group] = g;
    weight_[g] = static_cast<float>(exchange.weight(mesh_group));
    area_[g] = static_cast<float>(mesh.groups[mesh_group].area);
    update_group(g);
  }
}

void Radiosity::update_group(std::uint32_t local_group) {
  const GroupPlace& place = tree_.groups[local_group];
  Rgb unshot{0.0}, whole{0.0}, answer{0.0}, received{0.0};
  for (std::uint32_t p = place.first_patch; p < place.first_patch + place.patch_count; ++p) {
    unshot += patches[p].unshot_w();
    whole += patches[p].exitance * patches[p].area + patches[p].reflectance * patches[p].received_w;
    answer += patches[p].reflectance * patches[p].area;
    received += patches[p].received_w;
  }
  sums_[local_group] = {Rgbf{unshot}, Rgbf{whole}, Rgbf{answer}, Rgbf{received}};
}

Rgbf Radiosity::still_expected(std::size_t group) const {
  const Expected& then = expected_[group];
  const Rgbf come = (sums_[group].received_w - then.received_w) / area_[group];
  const Rgbf zero{0.f};
  return glm::clamp(then.irradiance - come, glm::min(then.irradiance, zero), glm::max(then.irradiance, zero));
}

float Radiosity::key(std::size_t group) const {
  const GroupSums& sums = sums_[group];
  const Rgbf ahead = glm::abs(sums.unshot_w + sums.answer * still_expected(group));
  // What the elements' single precision can't tell from nothing is nothing: shooting it again and again would not end. In sums
  // over the groups it counts: there it may well be something.
  constexpr auto rounding = static_cast<float>(single_precision);
  float power_w = 0;
  for (int c = 0; c < 3; ++c) power_w += ahead[c] < rounding * sums.whole_w[c] ? 0.f : ahead[c];
  return power_w * weight_[group];
}

std::size_t Radiosity::strongest_group() const {
  std::size_t best = 0;
  float most = -1;
  for (std::size_t g = 0; g < sums_.size(); ++g)
    if (const float power_w = key(g); power_w > most) most = power_w, best = g;
  return best;
}

void Radiosity::expect() {
  std::vector<ExpectedLight::Unshot> unshot;
  for (std::size_t g = 0; g < sums_.size(); ++g) unshot.push_back(this->unshot(g));
  ahead_.find(unshot);
  for (std::size_t g = 0; g < sums_.size(); ++g) expected_[g] = {Rgbf{ahead_.irradiance(g)}, sums_[g].received_w};
  changes_ = 0;
}

CellLight::Candidate Radiosity::strongest() {
  if (!is_changed_ || sums_.empty()) return strongest_;
  is_changed_ = false, ++changes_;
  // The expected is found anew when half of what it was found for is done, or much has happened since.
  std::size_t best = strongest_group();
  if (const float now = key(best); now < 0.5f * key_then_ || now > 2 * key_then_ || changes_ > sums_.size()) {
    expect();
    best = strongest_group();
    key_then_ = key(best);
  }
  const float power_w = key(best);
  strongest_ = power_w > 0.f ? CellLight::Candidate{GroupId{tree_.groups[best].mesh_group}, power_w} : CellLight::Candidate{};
  return strongest_;
}

void Radiosity::take(std::uint32_t local_group, Shot& shot) {
  const GroupPlace& place = tree_.groups[local_group];
  const Rgb expected{still_expected(local_group)};
  for (std::uint32_t p = place.first_patch; p < place.first_patch + place.patch_count; ++p) {
    PatchLight& light = patches[p];
    const PatchPlace& where = tree_.patches[p];
    const Patch& patch = mesh_.patches[where.mesh_patch];
    ShotPatch& out = shot.patches[p - place.first_patch];

    const Rgb emitted = light.exitance - light.emission_shot;
    const Rgb ahead = light.reflectance * expected;
    const bool is_refined = patch.fineness > 1;  // several elements share a place
    std::uint32_t veiled = 0;                    // bit i: place i, as soon as one of its elements is
    Rgb sum_w{0.0}, received_w{0.0};
    for (std::uint32_t k = 0; k < patch.element_count; ++k) {
      const auto [cluster, lane] = where.lane_of(k);
      ClusterLight& lanes = clusters[cluster];
      const Element& element = mesh_.elements[patch.first_element + k];
      Rgbf delta;
      for (int c = 0; c < 3; ++c) {
        const double radiosity = light.exitance[c] + light.reflectance[c] * lanes.irradiance(c, lane) + ahead[c];
        // What is sent is what is recorded, to the last bit: else their rounding errors add up to light that nobody shoots.
        const float before = lanes.shot[c][lane], after = static_cast<float>(radiosity);
        delta[c] = after - before;
        lanes.shot[c][lane] = before + delta[c];
        received_w[c] += lanes.irradiance(c, lane) * element.area;
      }
      const std::size_t grid_place = shooting_place(patch, element);
      const float weight = is_refined ? element.area : 1.f;
      out.delta[grid_place] += weight * delta;
      out.area[grid_place] += element.area;
      const float openness = tree_.clusters[cluster].openness[lane];
      out.openness[grid_place] += weight * openness;
      if (openness <= 0) veiled |= 1u << grid_place;
      sum_w += Rgb{delta} * static_cast<double>(element.area);
    }
    for (std::size_t k = 0; is_refined && k < out.area.size(); ++k)
      if (out.area[k] > 0) out.delta[k] /= out.area[k], out.openness[k] /= out.area[k];
    for (; veiled != 0; veiled &= veiled - 1) out.openness[static_cast<std::size_t>(__builtin_ctz(veiled))] = 0;
    light.shot_w += sum_w;
    light.received_w = received_w;  // as the elements hold it
    light.emission_shot = light.exitance;
    out.emitted = Rgbf{emitted};
    out.reflected = Rgbf{sum_w / light.area - emitted};
  }
  update_group(local_group);
}

CellPower Radiosity::power() const {
  CellPower power;
  for (const PatchLight& p : patches) {
    const Rgb unshot = p.unshot_w();
    power.unshot += unshot;
    power.unshot_absolute += glm::abs(unshot);
    power.emitted += p.exitance * p.area;
    power.absorbed += (1.0 - p.reflectance) * p.received_w;
    power.shot += p.shot_w;
    power.received += p.received_w;
    power.area += p.area;
  }
  return power;
}

std::size_t Radiosity::memory_bytes() const {
  return bytes_of_all(clusters, patches, local_group_of_, sums_, expected_, weight_, area_) + ahead_.memory_bytes();
}

}  // namespace lichthof
