#include <algorithm>
#include <functional>
#include <limits>

#include "bench/measure.hpp"
#include "bench/packets.hpp"
#include "bench/sections.hpp"
#include "core/light/transfer.hpp"

namespace lichthof::bench {

namespace {

constexpr std::size_t packet_count = 1024;  // 0.8 MB: they stay in the cache, as a shot's own packet does
constexpr std::uint64_t keep_every =
    61;  // packet of the pass; shares no factor with the 16 or 64 elements of a shooter

/// Collects rays of the pass, every so manieth packet, into full packets: what the ray tracer is best given.
class PacketSample : public PacketObserver {
 public:
  void see(const Segments16& packet, std::uint32_t lanes) override {
    if (seen_++ % keep_every != 0) return;
    for (; lanes != 0; lanes &= lanes - 1) {
      if (used_ == 0) clear_segments(packets_.emplace_back());
      const int from = __builtin_ctz(lanes), to = used_;
      Segments16& last = packets_.back();
      last.ox[to] = packet.ox[from], last.oy[to] = packet.oy[from], last.oz[to] = packet.oz[from];
      last.dx[to] = packet.dx[from], last.dy[to] = packet.dy[from], last.dz[to] = packet.dz[from];
      used_ = (used_ + 1) % 16;
    }
  }
  std::vector<Segments16> full_packets() && {
    if (used_ != 0) packets_.pop_back();
    return std::move(packets_);
  }

 private:
  std::uint64_t seen_ = 0;
  int used_ = 0;
  std::vector<Segments16> packets_;
};

/// Shots and transfers of the first pass without its actors.
struct Transfers {
  std::uint64_t rays = 0, saved = 0, form_factors = 0;
  double take_s = 0;     ///< CPU: choosing and taking shots
  double receive_s = 0;  ///< CPU: transfers
};

/// Repeats a pass in one cell, shot by shot.
/// @param observe  called with each shot, unmeasured; may be empty
Transfers transfers_of(const BenchCase& scene, std::uint64_t shots,
                       const std::function<void(const Shot&)>& observe = {}) {
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
    sum.rays += work.rays;
    sum.saved += work.rays_saved;
    sum.form_factors += work.form_factors;
    if (observe) observe(shot);
  }
  return sum;
}

/// The pass's own rays, as seen by the transfer of its shots into receivers of the same scene.
std::vector<Segments16> own_packets(const BenchCase& scene, const PacketScene& packets, std::uint64_t shots) {
  const Occluders occluders(*scene.scene(), scene.scene()->surfaces, packets.origin, packets.rays.offset());
  const ElementOutlines outlines(*scene.mesh(), {});
  const TransferOptions options;
  PacketSample sample;
  constexpr float everywhere = std::numeric_limits<float>::infinity();
  const Parallel alone(1);
  const GroupExchange exchange(*scene.scene(), *scene.mesh(), alone);
  const TransferScene into{*scene.mesh(),  packets.tree, packets.rays, occluders, outlines, options,
                           packets.origin, everywhere,   exchange,     true,      nullptr,  &sample};
  Radiosity unused(*scene.mesh(), packets.tree, exchange);
  transfers_of(scene, shots, [&](const Shot& shot) { transfer(shot, nullptr, into, unused, alone); });
  return std::move(sample).full_packets();
}

/// Rays per CPU second of occluded16 alone, and the share of them that is blocked.
struct RawRays {
  double per_s = 0, blocked = 0;
};
RawRays raw_rays(const PacketScene& scene, std::vector<Segments16>& packets) {
  if (packets.empty()) return {};
  LaneMask16 all;
  std::fill_n(all.lane, 16, -1);
  const auto trace = [&] {
    for (Segments16& packet : packets) {
      std::fill_n(packet.tfar, 16, 1.f);
      scene.rays.occluded16(packet, all);
    }
  };
  const double seconds = cpu_s_per_call(trace, 0.2);
  double blocked = 0;
  for (const Segments16& packet : packets)
    for (const float t : packet.tfar) blocked += t < 0;
  const double rays = 16.0 * static_cast<double>(packets.size());
  return {rays / seconds, blocked / rays};
}

}  // namespace

Expected<Section> radiosity_section(const BenchCase& scene) {
  const PacketScene packets(scene);
  std::vector<Segments16> own, random = packets_of(scene, packets, packet_count, 21);
  RawRays raw, raw_random;
  Transfers transfers;
  SolveCounters counters;
  double pass_s = 1e300, transfer_s = 1e300, take_s = 1e300;
  for (unsigned round = 0; round < scene.repeat(); ++round) {
    const Expected<Solved> solved = scene.solve();
    if (!solved) return solved.error();
    pass_s = std::min(pass_s, solved->cpu_s);
    counters = solved->solution.counters;
    if (round == 0) own = own_packets(scene, packets, counters.shots);
    for (const auto& [best, rays] : {std::pair{&raw, &own}, std::pair{&raw_random, &random}})
      if (const RawRays now = raw_rays(packets, *rays); now.per_s > best->per_s) *best = now;
    transfers = transfers_of(scene, counters.shots);
    if (scene.stopped()) return BenchCase::interrupted();
    transfer_s = std::min(transfer_s, transfers.receive_s), take_s = std::min(take_s, transfers.take_s);
  }
  const auto rays = static_cast<double>(transfers.rays);
  Section section{"radiosity", {}};
  section.add("elements", "elements", static_cast<double>(scene.mesh()->elements.size()));
  section.add("shots", "shots", static_cast<double>(counters.shots));
  section.add("same_rays", "rays of the pass : rays of its repetition", static_cast<double>(counters.rays) / rays);
  section.add("rays", "shadow rays answered", rays);
  section.add("saved", "share of them answered without the ray tracer", static_cast<double>(transfers.saved) / rays);
  section.add("pairs_per_ray", "form factors per ray", static_cast<double>(transfers.form_factors) / rays);
  section.add("pass_s", "CPU time of the whole pass", pass_s, "s");
  section.add("transfer_s", "CPU time of its transfers alone", transfer_s, "s");
  section.add("take_s", "CPU time of choosing and taking shots", take_s, "s");
  section.add("net_per_s", "rays per CPU second, whole pass", rays / pass_s, "1/s");
  section.add("raw_per_s", "ray tracer alone on rays of the pass, in full packets", raw.per_s, "1/s");
  section.add("raw_blocked", "share of those that is blocked", raw.blocked);
  section.add("raw_random_per_s", "ray tracer alone on rays between random receivers and patches", raw_random.per_s,
              "1/s");
  section.add("raw_random_blocked", "share of those that is blocked", raw_random.blocked);
  section.add("transfer_ratio", "transfers alone : ray tracer alone on the same rays", rays / transfer_s / raw.per_s);
  section.add("ratio", "whole pass : ray tracer alone on the same rays", rays / pass_s / raw.per_s, "", at_least(0.6));
  section.add("ratio_random", "whole pass : ray tracer alone on random rays", rays / pass_s / raw_random.per_s);
  return section;
}

}  // namespace lichthof::bench
