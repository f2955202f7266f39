/// What a worker of the second pass can do, and all a worker knows of light: turn columns into pixels.
#pragma once

#include <cstdint>
#include <vector>

#include "core/base/types.hpp"
#include "core/protocol/messages.hpp"

namespace lichthof {

/// Duties of an implementation: the pixels of a column depend on the column alone, never on the job it came in, on the
/// worker or on the number of threads; safe for use from several threads at once.
class ColumnSource {
 public:
  virtual ~ColumnSource() = default;
  virtual std::uint32_t width() const = 0;
  virtual std::uint32_t height() const = 0;
  /// Linear RGB radiance of the columns [first, last), column by column from top to bottom.
  /// @param rays  grows by the number of rays that were traced
  virtual std::vector<Rgbf> columns(const ColumnJob& job, std::uint64_t& rays) const = 0;
  /// What all workers on this source share (bytes).
  virtual std::size_t memory_bytes() const { return 0; }
};

}  // namespace lichthof
