/// The part of the dispatcher that outlives it: the journal read back, and written short.
#include "core/cluster/dispatcher.hpp"

namespace lichthof {

namespace {

template <class... F>
struct Overloaded : F... {
  using F::operator()...;
};
template <class... F>
Overloaded(F...) -> Overloaded<F...>;

JobId job_of(const JournalEntry& entry) {
  return std::visit(
      [](const auto& e) {
        if constexpr (requires { e.job; })
          return e.job;
        else
          return JobId{};
      },
      entry);
}

}  // namespace

Expected<Dispatcher> Dispatcher::restored(const DispatcherOptions& options, std::span<const JournalEntry> journal) {
  Dispatcher dispatcher(options);
  for (std::size_t i = 0; i < journal.size(); ++i)
    if (Status status = dispatcher.replay(journal[i]); !status) {
      status.error().where = "journal entry " + std::to_string(i + 1);
      return status.error();
    }
  for (auto& [id, job] : dispatcher.jobs_)
    if (job.state == JobState::queued && job.epoch > Epoch{})
      job.reason = "waits for nodes since the controller's restart";
  return dispatcher;
}

Status Dispatcher::replay(const JournalEntry& entry) {
  const auto refused = [](const std::string& message) { return Error{ErrorCode::bad_input, {}, message}; };
  if (const auto* submitted = std::get_if<journal::Submitted>(&entry)) {
    if (submitted->job.value <= last_job_) return refused("job numbers do not grow");
    if (Status can_be = plausible(submitted->wish); !can_be) return can_be;
    last_job_ = submitted->job.value;
    LabJob& job = jobs_[submitted->job];
    job.wish = submitted->wish;
    job.pass = job.wish.radiosity ? Pass::radiosity : Pass::picture;
    return Done{};
  }
  if (const auto* numbered = std::get_if<journal::Numbered>(&entry)) {
    if (numbered->job.value < last_job_) return refused("job numbers do not grow");
    last_job_ = numbered->job.value;
    return Done{};
  }
  if (const auto* draining = std::get_if<journal::Draining>(&entry)) {
    if (draining->is_draining)
      draining_.insert(draining->node);
    else
      draining_.erase(draining->node);
    return Done{};
  }
  const JobId id = job_of(entry);
  const auto found = jobs_.find(id);
  if (found == jobs_.end()) return refused("job " + std::to_string(id.value) + " was never submitted");
  LabJob& job = found->second;
  const bool is_for_ended =
      std::holds_alternative<journal::Retried>(entry) || std::holds_alternative<journal::Forgotten>(entry);
  if (has_ended(job.state) != is_for_ended)
    return refused("job " + std::to_string(id.value) + (has_ended(job.state) ? " had ended" : " had not ended"));
  return std::visit(Overloaded{[&](const journal::EpochBegun& e) -> Status {
                                 if (e.epoch <= job.epoch) return refused("epochs do not grow");
                                 job.epoch = e.epoch;
                                 return Done{};
                               },
                               [&](const journal::CheckpointKept&) -> Status {
                                 job.has_checkpoint = true;
                                 return Done{};
                               },
                               [&](const journal::NodeLost& e) -> Status {
                                 job.lost_nodes.push_back(e.name);
                                 return Done{};
                               },
                               [&](const journal::PassFinished& e) -> Status {
                                 if (e.pass == Pass::radiosity && job.wish.picture) job.pass = Pass::picture;
                                 return Done{};
                               },
                               [&](const journal::Ended& e) -> Status {
                                 if (!has_ended(e.state)) return refused("ended in no end");
                                 job.state = e.state;
                                 job.reason = e.reason;
                                 return Done{};
                               },
                               [&](const journal::Retried&) -> Status {
                                 if (job.state == JobState::done) return refused("a job that is done is not retried");
                                 job.state = JobState::queued;
                                 job.reason.clear();
                                 job.lost_nodes.clear();
                                 return Done{};
                               },
                               [&](const journal::Forgotten&) -> Status {
                                 jobs_.erase(found);
                                 return Done{};
                               },
                               [&](const auto&) -> Status { return Done{}; }},
                    entry);
}

std::vector<JournalEntry> Dispatcher::summary() const {
  std::vector<JournalEntry> entries;
  for (const auto& [id, job] : jobs_) {
    entries.push_back(journal::Submitted{id, job.wish});
    if (job.epoch > Epoch{}) entries.push_back(journal::EpochBegun{id, job.epoch});
    if (job.has_checkpoint) entries.push_back(journal::CheckpointKept{id});
    if (job.pass == Pass::picture && job.wish.radiosity) entries.push_back(journal::PassFinished{id, Pass::radiosity});
    for (const std::string& name : job.lost_nodes) entries.push_back(journal::NodeLost{id, name});
    if (has_ended(job.state)) entries.push_back(journal::Ended{id, job.state, job.reason});
  }
  if (jobs_.empty() ? last_job_ > 0 : jobs_.rbegin()->first.value < last_job_)
    entries.push_back(journal::Numbered{JobId{last_job_}});
  for (const std::string& node : draining_) entries.push_back(journal::Draining{node, true});
  return entries;
}

}  // namespace lichthof
