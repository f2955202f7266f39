/// The load balancer of the second pass (Fig. 5): who traces which columns. It alone knows job sizes.
///
///     Ratio = 1 / (1 + T·(N − 1)),   job = max(1, ⌊W · Ratio⌋)
///
/// W is the number of columns not yet handed out, N the number of workers, T the largest ratio of times of two jobs of
/// equal size. (The printed "1^(N−1)" is a scan error.) The reason: a job J must not outlast the rest of the work on the
/// other N − 1 workers even if it is T times as heavy, J·T ≤ (W − J)/(N − 1). The first N jobs have equal sizes.
#pragma once

#include <cstdint>
#include <deque>
#include <set>
#include <vector>

#include "core/protocol/effects.hpp"
#include "core/tracing/image.hpp"

namespace lichthof {

enum class Scheduling : std::uint8_t {
  adaptive,  ///< Fig. 5
  boxes,     ///< equally sized parts on demand: what Tab. 2 compares with
};

struct BalancerOptions {
  std::uint32_t columns = 0, height = 0;  ///< of the screen; both ≥ 1
  std::uint32_t workers = 1;              ///< N, those expected at the start; ≥ 1
  Scheduling scheduling = Scheduling::adaptive;
  /// T ≥ 1, "must be set empirically". With 38 workers and 1024 columns that differ by a factor of 5, simulated speed-ups
  /// are 22.2, 32.1, 37.5, 37.5, 37.5, 37.5 for T = 1, 1.5, 2, 4, 8, 16, with 74, 222, 296, 506, 786, 1024 jobs: too small
  /// a T costs time, too large a one only messages. 4 leaves a factor of two for pictures more uneven than that.
  double time_ratio = 4.0;
  std::uint32_t boxes = 64;  ///< number of parts when scheduling boxes
  /// An idle worker that finds nothing to hand out gets columns that another one still has, those out for longest first;
  /// nobody a column that two have already. The first result counts. For workers that may hang, or become slow.
  bool second_runs = false;
};

/// Messages in: JobRequest, ColumnResult, WorkerLost. Out: JobAssignment to workers. A request that finds nothing to hand
/// out waits until the picture is finished: a lost worker's columns may come back. A column counts once, with its rays,
/// whoever traces it and how often.
class Balancer {
 public:
  explicit Balancer(const BalancerOptions& options);

  void accept(const Envelope& envelope, Instant now);
  bool has_work() const { return !inbox_.empty(); }
  /// Deals with one message.
  Effects step(Instant now);

  bool finished() const { return finished_columns_ == options_.columns; }
  std::uint32_t finished_columns() const { return finished_columns_; }
  std::uint32_t jobs_assigned() const { return jobs_; }
  std::uint32_t second_runs() const { return second_runs_; }  ///< of those
  std::uint64_t rays() const { return rays_; }
  bool is_finished(std::uint32_t column) const { return is_finished_[column] != 0; }
  std::uint64_t rays(std::uint32_t column) const { return column_rays_[column]; }
  /// The film; columns not finished are black.
  const Image& image() const { return image_; }

 private:
  void on(const JobRequest& request, Effects& effects);
  void on(const ColumnResult& result, Effects& effects);
  void on(const WorkerLost& lost, Effects& effects);
  void serve_waiting(Effects& effects);
  ColumnJob next_job();
  ColumnJob second_run(WorkerId worker) const;
  void assign(WorkerId worker, const ColumnJob& job, Effects& effects);
  std::uint32_t next_size();
  void return_to_pool(const ColumnJob& job);
  void take_back(WorkerId worker);
  /// Per column: how many have it.
  std::vector<std::uint8_t> holders() const;

  struct HandedOut {
    WorkerId worker;
    ColumnJob job;
  };
  BalancerOptions options_;
  std::deque<Message> inbox_;
  std::vector<ColumnJob> pool_;      ///< nobody has them, ascending, disjoint
  std::uint32_t work_load_ = 0;      ///< columns in the pool
  std::vector<HandedOut> assigned_;  ///< in the order they were handed out; their results have not come
  std::deque<WorkerId> waiting_;
  std::set<WorkerId> known_, refused_;  ///< workers at hand; workers that sent nonsense
  std::uint32_t workers_;               ///< N
  std::uint32_t first_round_left_, first_round_size_ = 1;
  std::vector<std::uint8_t> is_finished_;   ///< per column
  std::vector<std::uint64_t> column_rays_;  ///< likewise
  std::uint32_t finished_columns_ = 0, jobs_ = 0, second_runs_ = 0;
  std::uint64_t rays_ = 0;
  Image image_;
};

}  // namespace lichthof
