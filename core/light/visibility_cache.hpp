/// What shadow rays answered, kept for the next shot of the same group: geometry stands still, so the answers do too.
#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <utility>
#include <vector>

#include "core/base/ids.hpp"

namespace lichthof {

/// The answers of one shot in the order in which they were asked, one word each: 1 or 0 for a box of the receiver tree (hidden
/// or not), the lanes that see the shooter for a packet of 16 rays. The parts belong to the islands of the receiver tree.
struct VisibilityAnswers {
  explicit VisibilityAnswers(std::span<const std::vector<std::uint16_t>> by_island);
  std::vector<std::uint16_t> words;
  std::vector<std::uint32_t> first;  ///< by island, and one more
  std::span<const std::uint16_t> of_island(std::size_t island) const {
    return std::span(words).subspan(first[island], first[island + 1] - first[island]);
  }
  std::size_t bytes() const { return words.size() * sizeof(words[0]) + first.size() * sizeof(first[0]); }
};

/// For the shots of one cell into itself, until the memory is spent: who shoots first is strongest, and shoots most often.
class VisibilityCache {
 public:
  explicit VisibilityCache(std::size_t most_bytes) : most_bytes_(most_bytes) {}

  /// Which questions a shot asks depends on its group and on these two.
  struct Key {
    GroupId group;
    bool reflects = false, emits = false;
    auto operator<=>(const Key&) const = default;
  };

  /// nullptr: not kept
  const VisibilityAnswers* find(const Key& key) const;
  bool has_room() const { return bytes_ < most_bytes_; }
  void keep(const Key& key, VisibilityAnswers answers);
  std::size_t bytes() const { return bytes_; }

 private:
  std::size_t most_bytes_, bytes_ = 0;
  std::map<Key, VisibilityAnswers> kept_;
};

}  // namespace lichthof
