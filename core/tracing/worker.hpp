/// A worker of the second pass: asks for a job, traces it, delivers it, asks again.
#pragma once

#include <deque>
#include <memory>
#include <vector>

#include "core/protocol/effects.hpp"
#include "core/tracing/column_source.hpp"

namespace lichthof {

/// Messages in: JobAssignment. Out, to the balancer: JobRequest, ColumnResult. A step traces at most `columns_per_step`
/// columns, so that control messages slip in between.
class Worker {
 public:
  Worker(WorkerId id, std::shared_ptr<const ColumnSource> source, std::uint32_t columns_per_step = 4);

  void accept(const Envelope& envelope, Instant now);
  bool has_work() const { return !resting_ && (!asked_ || traced_ < job_.last); }
  Effects step(Instant now);

  /// Told that all columns are handed out and finished.
  bool resting() const { return resting_; }

 private:
  WorkerId id_;
  std::shared_ptr<const ColumnSource> source_;
  std::uint32_t columns_per_step_;
  ColumnJob job_;
  std::uint32_t traced_ = 0;  ///< columns of the job before this one are done
  std::vector<Rgbf> pixels_;
  std::vector<std::uint64_t> rays_;  ///< per column
  bool asked_ = false, resting_ = false;
};

}  // namespace lichthof
