#include <algorithm>

#include "bench/measure.hpp"
#include "bench/packets.hpp"
#include "bench/sections.hpp"
#include "core/light/cell_light.hpp"

namespace lichthof::bench {

namespace {

constexpr std::size_t packet_count = 1024;  // 0.8 MB: they stay in the cache, as a shot's own packet does

/// Shots and transfers of the first pass without its actors.
struct Transfers {
  std::uint64_t traced = 0, saved = 0, form_factors = 0;
  double take_s = 0;     ///< CPU: choosing and taking shots
  double receive_s = 0;  ///< CPU: transfers
};

/// Repeats a pass in one cell, shot by shot.
Transfers transfers_of(const BenchCase& scene, std::uint64_t shots) {
  std::vector<GroupId> groups;
  for (std::uint32_t g = 0; g < scene.mesh()->groups.size(); ++g) groups.push_back(GroupId{g});
  Box everywhere;
  everywhere.lo = Vec3{-1e300}, everywhere.hi = Vec3{1e300};
  CellLight light(scene.scene(), scene.mesh(), groups, everywhere, {}, std::make_shared<const Parallel>(1));
  Transfers sum;
  for (std::uint64_t k = 0; k < shots && !scene.stopped(); ++k) {
    const double start = cpu_s();
    const CellLight::Candidate next = light.strongest();
    if (next.power_w <= 0) break;
    const Shot shot = light.take_shot(next.group, {}, {});
    const double taken = cpu_s();
    const TransferWork work = light.receive(shot, nullptr);
    sum.take_s += taken - start;
    sum.receive_s += cpu_s() - taken;
    sum.traced += work.rays;
    sum.saved += work.rays_saved;
    sum.form_factors += work.form_factors;
  }
  return sum;
}

/// Rays per CPU second of occluded16, and the share of them that is blocked.
struct RawRays {
  double per_s = 0, blocked = 0;
};
RawRays raw_rays(const BenchCase& scene) {
  const PacketScene packets(scene);
  std::vector<Segments16> filled = packets_of(scene, packets, packet_count, 21);
  if (filled.empty()) return {};
  LaneMask16 all;
  std::fill_n(all.lane, 16, -1);
  const auto trace = [&] {
    for (Segments16& packet : filled) {
      std::fill_n(packet.tfar, 16, 1.f);
      packets.rays.occluded16(packet, all);
    }
  };
  double best = 1e300;
  for (unsigned round = 0; round < scene.repeat(); ++round) best = std::min(best, cpu_s_per_call(trace, 0.2));
  double blocked = 0;
  for (const Segments16& packet : filled)
    for (const float t : packet.tfar) blocked += t < 0;
  const double rays = 16.0 * static_cast<double>(filled.size());
  return {rays / best, blocked / rays};
}

}  // namespace

Expected<Section> radiosity_section(const BenchCase& scene) {
  RawRays raw;
  Transfers transfers;
  SolveCounters counters;
  double pass_s = 1e300, transfer_s = 1e300, take_s = 1e300;
  for (unsigned round = 0; round < scene.repeat(); ++round) {
    const Expected<Solved> solved = scene.solve();
    if (!solved) return solved.error();
    pass_s = std::min(pass_s, solved->cpu_s);
    counters = solved->solution.counters;
    const RawRays now = raw_rays(scene);
    if (now.per_s > raw.per_s) raw = now;
    transfers = transfers_of(scene, counters.shots);
    if (scene.stopped()) return BenchCase::interrupted();
    transfer_s = std::min(transfer_s, transfers.receive_s), take_s = std::min(take_s, transfers.take_s);
  }
  const auto traced = static_cast<double>(transfers.traced);
  const double answered = traced + static_cast<double>(transfers.saved);
  Section section{"radiosity", {}};
  section.add("elements", "elements", static_cast<double>(scene.mesh()->elements.size()));
  section.add("shots", "shots", static_cast<double>(counters.shots));
  section.add("same_rays", "rays of the pass : rays of its repetition", static_cast<double>(counters.rays) / traced);
  section.add("rays_traced", "rays traced", traced);
  section.add("rays_answered", "rays answered, with those an occluder known already blocked", answered);
  section.add("pairs_per_ray", "form factors per ray answered", static_cast<double>(transfers.form_factors) / answered);
  section.add("pass_s", "CPU time of the whole pass", pass_s, "s");
  section.add("transfer_s", "CPU time of its transfers alone", transfer_s, "s");
  section.add("take_s", "CPU time of choosing and taking shots", take_s, "s");
  section.add("raw_per_s", "ray tracer alone, packets of 16", raw.per_s, "1/s");
  section.add("raw_blocked", "share of those that is blocked", raw.blocked);
  section.add("traced_per_s", "rays traced per CPU second, whole pass", traced / pass_s, "1/s");
  section.add("net_per_s", "rays answered per CPU second, whole pass", answered / pass_s, "1/s");
  section.add("transfer_ratio", "answered : ray tracer alone, transfers alone", answered / transfer_s / raw.per_s);
  section.add("ratio", "answered : ray tracer alone, whole pass", answered / pass_s / raw.per_s, "", at_least(0.6));
  return section;
}

}  // namespace lichthof::bench
