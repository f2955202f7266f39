/// Memory that containers take: what monitoring shows of cells and workers is counted, not estimated.
#pragma once

#include <cstddef>
#include <vector>

namespace lichthof {

/// Of the elements themselves; what they own in turn is for the caller to add (bytes).
template <class T>
std::size_t bytes_of(const std::vector<T>& values) {
  return values.capacity() * sizeof(T);
}
template <class... T>
std::size_t bytes_of_all(const std::vector<T>&... values) {
  return (bytes_of(values) + ... + 0);
}

/// Of a node in a std::map around its value: three pointers and a colour.
inline constexpr std::size_t tree_node_bytes = 4 * sizeof(void*);

}  // namespace lichthof
