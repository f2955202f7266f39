#include "core/light/visibility_cache.hpp"

namespace lichthof {

VisibilityAnswers::VisibilityAnswers(std::span<const std::vector<std::uint16_t>> by_island) {
  first.reserve(by_island.size() + 1);
  first.push_back(0);
  for (const std::vector<std::uint16_t>& part : by_island)
    first.push_back(first.back() + static_cast<std::uint32_t>(part.size()));
  words.reserve(first.back());
  for (const std::vector<std::uint16_t>& part : by_island) words.insert(words.end(), part.begin(), part.end());
}

const VisibilityAnswers* VisibilityCache::find(const Key& key) const {
  const auto found = kept_.find(key);
  return found == kept_.end() ? nullptr : &found->second;
}

void VisibilityCache::keep(const Key& key, VisibilityAnswers answers) {
  const std::size_t bytes = answers.bytes() + sizeof(VisibilityAnswers);
  if (bytes_ + bytes > most_bytes_) {
    bytes_ = most_bytes_;  // full: what comes later is weaker
    return;
  }
  if (kept_.emplace(key, std::move(answers)).second) bytes_ += bytes;
}

}  // namespace lichthof
