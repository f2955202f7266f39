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

Radiosity::Radiosity(const Mesh& mesh, const ReceiverTree& tree)
    : clusters(tree.clusters.size()), patches(tree.patches.size()), mesh_(mesh), tree_(tree) {
  for (std::size_t p = 0; p < patches.size(); ++p) {
    const Patch& patch = mesh.patches[tree.patches[p].mesh_patch];
    patches[p].reflectance = patch.reflectance;
    patches[p].exitance = patch.exitance;
    // The area that receives: the sum over elements, in the precision they are summed with.
    for (std::uint32_t e = patch.first_element; e < patch.first_element + patch.element_count; ++e)
      patches[p].area += mesh.elements[e].area;
    area_ += patches[p].area;
  }
  local_group_of_.assign(mesh.groups.size(), ~0u);
  for (int c = 0; c < 3; ++c) {
    unshot_w_[c].assign(tree.groups.size(), 0.f);
    whole_w_[c].assign(tree.groups.size(), 0.f);
    answer_w_[c].assign(tree.groups.size(), 0.f);
    reflected_w_[c].assign(tree.groups.size(), 0.f);
    received_w_[c].assign(tree.groups.size(), 0.f);
  }
  for (std::uint32_t g = 0; g < tree.groups.size(); ++g) {
    local_group_of_[tree.groups[g].mesh_group] = g;
    update_group(g);
  }
}

void Radiosity::update_group(std::uint32_t local_group) {
  const GroupPlace& place = tree_.groups[local_group];
  Rgb unshot{0.0}, whole{0.0}, answer{0.0}, reflected{0.0}, received{0.0};
  for (std::uint32_t p = place.first_patch; p < place.first_patch + place.patch_count; ++p) {
    unshot += patches[p].unshot_w();
    whole += patches[p].exitance * patches[p].area + patches[p].reflectance * patches[p].received_w;
    answer += patches[p].reflectance * patches[p].area;
    reflected += patches[p].reflectance * patches[p].received_w;
    received += patches[p].received_w;
  }
  for (int c = 0; c < 3; ++c) {
    unshot_w_[c][local_group] = static_cast<float>(unshot[c]);
    whole_w_[c][local_group] = static_cast<float>(whole[c]);
    answer_w_[c][local_group] = static_cast<float>(answer[c]);
    reflected_w_[c][local_group] = static_cast<float>(reflected[c]);
    received_w_[c][local_group] = static_cast<float>(received[c]);
  }
}

void Radiosity::record_closure(const Shot& shot, const Rgb& received_w) {
  const Rgb sent_w = shot.power();
  sent_w_ += sent_w;
  arrived_w_ += received_w;
  Rgb absolute_w{0.0};
  for (const ShotPatch& patch : shot.patches)
    for (std::size_t k = 0; k < patch.area.size(); ++k)
      absolute_w += static_cast<double>(patch.area[k]) * glm::abs(Rgb{patch.delta[k]});
  for (int c = 0; c < 3; ++c) {
    if (!(sent_w_[c] > 0) || !(absolute_w[c] > 0)) continue;
    const double excess = received_w[c] - std::min(1.0, arrived_w_[c] / sent_w_[c]) * sent_w[c];
    excess_[c] = std::max(excess_[c], (sent_w[c] < 0 ? -excess : excess) / absolute_w[c]);
  }
}

namespace {
/// Sum in double precision, in eight strands so that it vectorises; the order is always the same.
double sum(const std::vector<float>& values) {
  double strand[8] = {};
  std::size_t i = 0;
  for (; i + 8 <= values.size(); i += 8)
    for (std::size_t k = 0; k < 8; ++k) strand[k] += values[i + k];
  for (; i < values.size(); ++i) strand[i % 8] += values[i];
  return ((strand[0] + strand[1]) + (strand[2] + strand[3])) + ((strand[4] + strand[5]) + (strand[6] + strand[7]));
}
}  // namespace

CellOutlook Radiosity::outlook() const {
  CellOutlook own = ahead();
  for (const PatchLight& patch : patches) own.sent_w += patch.shot_w;
  return own;
}

CellOutlook Radiosity::ahead() const {
  CellOutlook own;
  for (int c = 0; c < 3; ++c) {
    own.received_w[c] = sum(received_w_[c]);
    own.unshot_w[c] = sum(unshot_w_[c]);
    own.reflected_w[c] = sum(reflected_w_[c]);
    own.white_area[c] = sum(answer_w_[c]);
  }
  own.area = area_;
  return own;
}

void CellOutlook::add(const CellOutlook& other) {
  sent_w += other.sent_w;
  received_w += other.received_w;
  unshot_w += other.unshot_w;
  reflected_w += other.reflected_w;
  white_area += other.white_area;
  area += other.area;
}

ExpectedLight expected_light(const CellOutlook& outlook, const Rgb& closure, const Rgb& excess) {
  ExpectedLight expected;
  for (int c = 0; c < 3; ++c) {
    if (!(outlook.area > 0) || !(outlook.received_w[c] > 0)) continue;
    const double kappa = std::clamp(closure[c], 0.0, 1.0);
    // Closed and perfectly white would expect without bound. Nothing built is whiter than this; and what single shots bring too
    // much, they would bring as many times as they are expected.
    const auto total = [&](double reflectance) {
      return outlook.unshot_w[c] * kappa / std::max({1.0 - reflectance * kappa, reflectance * excess[c], 0.001});
    };
    expected.everywhere[c] = 0.5 * total(outlook.white_area[c] / outlook.area) / outlook.area;
    expected.in_proportion[c] = 0.5 * total(outlook.reflected_w[c] / outlook.received_w[c]) / outlook.received_w[c];
  }
  return expected;
}

ExpectedLight expected_light(const CellOutlook& scene) {
  Rgb closure{0.0};
  for (int c = 0; c < 3; ++c)
    if (scene.sent_w[c] > 0) closure[c] = scene.received_w[c] / scene.sent_w[c];
  return expected_light(scene, closure);
}

ExpectedLight Radiosity::expected() const {
  Rgb closure{0.0};
  for (int c = 0; c < 3; ++c)
    if (sent_w_[c] > 0) closure[c] = arrived_w_[c] / sent_w_[c];
  return expected_light(ahead(), closure, excess_);
}

CellLight::Candidate Radiosity::strongest() {
  expected_ = expected();
  const std::size_t count = tree_.groups.size();
  std::vector<float> power_w(count, 0.f);
  for (int c = 0; c < 3; ++c) {
    const auto everywhere = static_cast<float>(expected_.everywhere[c]);
    const auto in_proportion = static_cast<float>(expected_.in_proportion[c]);
    const float *unshot = unshot_w_[c].data(), *answer = answer_w_[c].data(), *reflected = reflected_w_[c].data();
    const float* whole = whole_w_[c].data();
    constexpr auto rounding = static_cast<float>(single_precision);
    for (std::size_t g = 0; g < count; ++g) {
      // What the elements' single precision can't tell from nothing is nothing: shooting it again and again would not end. In sums
      // over the groups it counts: there it may well be something.
      const float key_w = std::abs(unshot[g] + answer[g] * everywhere + reflected[g] * in_proportion);
      power_w[g] += key_w < rounding * whole[g] ? 0.f : key_w;
    }
  }
  const auto best = std::max_element(power_w.begin(), power_w.end());
  if (best == power_w.end() || *best <= 0.f) return {};
  return {GroupId{tree_.groups[static_cast<std::size_t>(best - power_w.begin())].mesh_group}, *best};
}

void Radiosity::take(std::uint32_t local_group, Shot& shot) {
  const GroupPlace& place = tree_.groups[local_group];
  for (std::uint32_t p = place.first_patch; p < place.first_patch + place.patch_count; ++p) {
    PatchLight& light = patches[p];
    const PatchPlace& where = tree_.patches[p];
    const Patch& patch = mesh_.patches[where.mesh_patch];
    ShotPatch& out = shot.patches[p - place.first_patch];

    const Rgb emitted = light.exitance - light.emission_shot;
    const Rgb ahead = light.reflectance * expected_.irradiance(light.received_w / light.area);
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
  std::size_t bytes = bytes_of_all(clusters, patches, local_group_of_);
  for (int c = 0; c < 3; ++c)
    bytes += bytes_of_all(unshot_w_[c], whole_w_[c], answer_w_[c], reflected_w_[c], received_w_[c]);
  return bytes;
}

}  // namespace lichthof
