/// What a person can do with a cluster, each as one question to the desk and one answer on stdout: the commands of the shell
/// and their one-shot forms are the same functions.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "apps/cluster/desk_client.hpp"
#include "apps/common/interruption.hpp"
#include "apps/common/options.hpp"

namespace lichthof::apps {

Status show_nodes(const DeskClient& client, const OutputOptions& talk);
Status show_actors(const DeskClient& client, const OutputOptions& talk);
Status show_methods(const DeskClient& client, const OutputOptions& talk);
Status show_jobs(const DeskClient& client, const OutputOptions& talk);
Status show_job(const DeskClient& client, std::uint64_t job, const OutputOptions& talk);
Status show_log(const DeskClient& client, std::uint64_t job, const OutputOptions& talk);

Status cancel_job(const DeskClient& client, std::uint64_t job, const OutputOptions& talk);
Status resume_job(const DeskClient& client, std::uint64_t job, const OutputOptions& talk);
Status drain_node(const DeskClient& client, const std::string& node, bool on, const OutputOptions& talk);
Status kick_node(const DeskClient& client, const std::string& node, const OutputOptions& talk);

/// Follows a job to its end with one line of progress per pass.
/// @returns  its last document, when it is done
/// @error    failed: it failed or was cancelled, with the reason; interrupted: the job runs on
Expected<nlohmann::json> followed(const DeskClient& client, std::uint64_t job, bool quiet,
                                  const Interruption& interruption);
Status watch_job(const DeskClient& client, std::uint64_t job, const OutputOptions& talk,
                 const Interruption& interruption);

inline const std::vector<std::string> result_endings{".exr", ".hdr", ".png", ".lht"};
/// Whether `file` could be written, and names a result by its ending. @error bad_input, io
Status result_file_ready(const std::string& file);
/// One result as the controller has it. @param kind  see LabService::result @returns bytes written
Expected<std::uint64_t> fetched(const DeskClient& client, std::uint64_t job, const std::string& file,
                                const std::string& kind);
/// What the file's ending says. @param exposure_ev  of a .png; none: automatic @returns bytes written
Expected<std::uint64_t> fetched_result(const DeskClient& client, std::uint64_t job, const std::string& file,
                                       const std::optional<double>& exposure_ev);
Status fetch_result(const DeskClient& client, std::uint64_t job, const std::string& file,
                    const std::optional<double>& exposure_ev, const OutputOptions& talk);

/// `lichthof submit` with this command line behind it, to a cluster that is known already.
Status submit_line(const std::vector<std::string>& words, const DeskClient& client, const OutputOptions& talk,
                   Interruption& interruption);

}  // namespace lichthof::apps
