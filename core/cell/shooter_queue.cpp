#include "core/cell/shooter_queue.hpp"

#include "core/base/check.hpp"
#include "core/base/footprint.hpp"

namespace lichthof {

void ShooterQueue::push(ExternalShot shot) {
  MUST(shot.shot);
  const Rank rank{shot.power_w, shot.shot->id};
  const bool is_new = by_version_[shot.shot->version].emplace(rank, std::move(shot)).second;
  MUST(is_new);
}

const ShooterQueue::Ranked* ShooterQueue::best_of(SceneVersion version) const {
  const Ranked* best = nullptr;
  for (const auto& [stamp, shots] : by_version_) {
    if (stamp > version) break;
    if (!best || shots.begin()->first < best->begin()->first) best = &shots;
  }
  return best;
}

NextShooter ShooterQueue::next(double local_w, double threshold_w, SceneVersion version) const {
  const bool local_is_ready = local_w > threshold_w;
  const Ranked* external = best_of(version);
  if (!external) return local_is_ready ? NextShooter::local : NextShooter::none;
  if (!local_is_ready || size() >= waiting_limit_) return NextShooter::external;
  return external->begin()->first.power_w >= local_w ? NextShooter::external : NextShooter::local;
}

ExternalShot ShooterQueue::pop_external(SceneVersion version) {
  const Ranked* best = best_of(version);
  MUST(best);
  const auto of_version = by_version_.find(best->begin()->second.shot->version);
  const auto first = of_version->second.begin();
  ExternalShot shot = std::move(first->second);
  of_version->second.erase(first);
  if (of_version->second.empty()) by_version_.erase(of_version);
  return shot;
}

double ShooterQueue::strongest_external(SceneVersion version) const {
  const Ranked* best = best_of(version);
  return best ? best->begin()->first.power_w : 0.0;
}

std::size_t ShooterQueue::size() const {
  std::size_t count = 0;
  for (const auto& [stamp, shots] : by_version_) count += shots.size();
  return count;
}

std::uint64_t ShooterQueue::parts() const {
  std::uint64_t count = 0;
  for (const auto& [stamp, shots] : by_version_)
    for (const auto& [rank, shot] : shots) count += shot.parts;
  return count;
}

std::size_t ShooterQueue::memory_bytes() const {
  std::size_t bytes = 0;
  for (const auto& [stamp, shots] : by_version_)
    for (const auto& [rank, shot] : shots) bytes += sizeof(Rank) + tree_node_bytes + shot.memory_bytes();
  return bytes;
}

}  // namespace lichthof
