/// What outlives the controller's process: its jobs, as one small file that is replaced as a whole after every decision. It is
/// there entirely or in its former state, whatever stops the process.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "actors/cluster/lead.hpp"

namespace lichthof::actors {

struct KeptJob {
  JobOrder order;
  std::string solution;                 ///< blob of the light so far
  double submitted_s = 0, ended_s = 0;  ///< since 1970; 0: has not ended
  bool is_fetched = false;              ///< somebody has had its result
};

struct LeadFile {
  std::vector<JournalEntry> journal;  ///< as Dispatcher::summary() gives it
  std::map<JobId, KeptJob> jobs;
};

/// @error io
Status write_lead_file(const std::string& path, const LeadFile& file);
/// A missing file is an empty one. @error bad_input: damaged, or of another version
Expected<LeadFile> read_lead_file(const std::string& path);

}  // namespace lichthof::actors
