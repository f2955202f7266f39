#include "bench/column_play.hpp"

#include <functional>
#include <map>
#include <numeric>
#include <queue>
#include <utility>

namespace lichthof::bench {

Play played(const std::vector<double>& column_s, std::uint32_t workers, Scheduling scheduling, double message_s) {
  BalancerOptions options;
  options.columns = static_cast<std::uint32_t>(column_s.size());
  options.height = 1;
  options.workers = workers;
  options.scheduling = scheduling;
  Balancer balancer(options);

  using Request = std::pair<double, std::uint32_t>;  // when, and by which worker
  std::priority_queue<Request, std::vector<Request>, std::greater<>> requests;
  std::map<std::uint32_t, ColumnJob> under_way;
  const auto tell = [&](Message message, double now) {
    balancer.accept({ToBalancer{}, ToBalancer{}, std::move(message)}, {});
    for (const Envelope& envelope : balancer.step({}).outbox) {
      const auto& assignment = std::get<JobAssignment>(envelope.message);
      if (assignment.no_more) continue;
      const std::uint32_t worker = std::get<WorkerId>(envelope.to).value;
      under_way[worker] = assignment.job;
      const auto first = column_s.begin() + assignment.job.first, last = column_s.begin() + assignment.job.last;
      requests.emplace(now + message_s + std::accumulate(first, last, 0.0), worker);
    }
  };
  for (std::uint32_t w = 0; w < workers; ++w) requests.emplace(0.0, w);
  double end = 0;
  while (!requests.empty() && !balancer.finished()) {
    const auto [now, worker] = requests.top();
    requests.pop();
    end = now;
    if (const auto job = under_way.find(worker); job != under_way.end()) {
      tell(ColumnResult{WorkerId{worker}, job->second, std::vector<Rgbf>(job->second.size()),
                        std::vector<std::uint64_t>(job->second.size(), 0), 0},
           now);
      under_way.erase(job);
    }
    tell(JobRequest{WorkerId{worker}}, now);
  }
  const double work = std::accumulate(column_s.begin(), column_s.end(), 0.0);
  return {work / end, 1 - work / (end * workers), balancer.jobs_assigned()};
}

}  // namespace lichthof::bench
