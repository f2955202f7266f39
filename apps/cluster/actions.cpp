#include "apps/cluster/actions.hpp"

#include <cctype>
#include <chrono>
#include <filesystem>
#include <thread>

#include "apps/cluster/lab_service.hpp"
#include "apps/cluster/tables.hpp"
#include "apps/common/files.hpp"
#include "apps/common/progress.hpp"
#include "apps/common/report.hpp"
#include "io/atomic_file.hpp"
#include "io/image_writer.hpp"
#include "io/text.hpp"

namespace lichthof::apps {

namespace {

using std::chrono::milliseconds;

constexpr milliseconds between_looks{500};
/// So often in a row a controller may not answer before following gives up: it may be starting anew.
constexpr int most_silences = 20;

std::string job_path(std::uint64_t job) { return "/v1/jobs/" + std::to_string(job); }

/// A name inside a path: whatever is not plain is escaped.
std::string escaped(const std::string& name) {
  constexpr const char* digits = "0123456789ABCDEF";
  std::string text;
  for (const char c : name) {
    const auto byte = static_cast<unsigned char>(c);
    if (std::isalnum(byte) || c == '.' || c == '_' || c == '-')
      text += c;
    else
      text += {'%', digits[byte >> 4], digits[byte & 15]};
  }
  return text;
}

nlohmann::json document(const char* command) { return {{"command", command}, {"version", LICHTHOF_VERSION}}; }

Status show(const DeskClient& client, const std::string& path, const char* key, Lines (*lines)(const nlohmann::json&),
            const OutputOptions& talk) {
  Expected<nlohmann::json> answer = client.get(path);
  if (!answer) return answer.error();
  nlohmann::json report = document(key);
  const Lines shown = lines(*answer);
  report[key] = std::move(*answer);
  return print(talk, report, shown);
}

Status act(const DeskClient& client, const std::string& path, const nlohmann::json& body, nlohmann::json report,
           const std::string& line, const OutputOptions& talk) {
  const Expected<nlohmann::json> answer = client.post(path, body);
  if (!answer) return answer.error();
  return print(talk, report, {line});
}

Status act_on_job(const DeskClient& client, std::uint64_t job, const char* action, const char* done,
                  const OutputOptions& talk) {
  nlohmann::json report = document("jobs");
  report["action"] = action;
  report["job"] = job;
  return act(client, job_path(job) + "/" + action, nlohmann::json::object(), report,
             "job " + std::to_string(job) + " " + done, talk);
}

}  // namespace

// ---- Looking ----------------------------------------------------------------------------------------------------------

Status show_nodes(const DeskClient& client, const OutputOptions& talk) {
  return show(client, "/v1/nodes", "nodes", node_lines, talk);
}
Status show_actors(const DeskClient& client, const OutputOptions& talk) {
  return show(client, "/v1/actors", "actors", actor_lines, talk);
}
Status show_methods(const DeskClient& client, const OutputOptions& talk) {
  return show(client, "/v1/methods", "methods", method_lines, talk);
}
Status show_jobs(const DeskClient& client, const OutputOptions& talk) {
  return show(client, "/v1/jobs", "jobs", job_lines, talk);
}
Status show_job(const DeskClient& client, std::uint64_t job, const OutputOptions& talk) {
  return show(client, job_path(job), "job", job_detail, talk);
}

Status show_log(const DeskClient& client, std::uint64_t job, const OutputOptions& talk) {
  const Expected<std::string> log = client.text(job_path(job) + "/log");
  if (!log) return log.error();
  Lines lines;
  for (io::Lines from(*log); from.next();) lines.push_back(io::printable(from.line()));
  nlohmann::json report = document("jobs");
  report["job"] = job;
  report["log"] = lines;
  return print(talk, report, lines);
}

// ---- Changing ---------------------------------------------------------------------------------------------------------

Status cancel_job(const DeskClient& client, std::uint64_t job, const OutputOptions& talk) {
  return act_on_job(client, job, "cancel", "is cancelled", talk);
}
Status resume_job(const DeskClient& client, std::uint64_t job, const OutputOptions& talk) {
  return act_on_job(client, job, "resume", "goes on", talk);
}

Status drain_node(const DeskClient& client, const std::string& node, bool on, const OutputOptions& talk) {
  nlohmann::json report = document("drain");
  report["node"] = node, report["on"] = on;
  return act(client, "/v1/nodes/" + escaped(node) + "/drain", {{"on", on}}, report,
             node + (on ? " gets no new work" : " takes work again"), talk);
}

Status kick_node(const DeskClient& client, const std::string& node, const OutputOptions& talk) {
  nlohmann::json report = document("kick");
  report["node"] = node;
  return act(client, "/v1/nodes/" + escaped(node) + "/kick", nlohmann::json::object(), report, node + " is let go",
             talk);
}

// ---- Following --------------------------------------------------------------------------------------------------------

Expected<nlohmann::json> followed(const DeskClient& client, std::uint64_t job, bool quiet,
                                  const Interruption& interruption) {
  const Interruption::Deferral deferral;
  ProgressLine line(!quiet);
  const std::string number = std::to_string(job);
  for (int silences = 0;;) {
    Expected<nlohmann::json> answer = client.get(job_path(job));
    if (!answer && (answer.error().code != ErrorCode::failed || ++silences > most_silences)) return answer.error();
    if (answer) {
      silences = 0;
      const std::string state = text_at(*answer, "state"), pass = text_at(*answer, "pass");
      line.show(io::printable("job " + number + " " + (pass.empty() ? state : pass)), number_at(*answer, "progress"));
      if (state == "done") return answer;
      if (is_over(state))
        return Error{
            ErrorCode::failed, "job " + number,
            state + (text_at(*answer, "reason").empty() ? "" : ": " + io::printable(text_at(*answer, "reason")))};
    }
    for (milliseconds slept{0}; slept < between_looks && !interruption.asked(); slept += milliseconds(50))
      std::this_thread::sleep_for(milliseconds(50));
    if (interruption.asked())
      return Error{ErrorCode::interrupted, "",
                   "job " + number + " runs on; follow it with: lichthof jobs watch " + number};
  }
}

Status watch_job(const DeskClient& client, std::uint64_t job, const OutputOptions& talk,
                 const Interruption& interruption) {
  Expected<nlohmann::json> last = followed(client, job, talk.quiet, interruption);
  if (!last) return last.error();
  nlohmann::json report = document("jobs");
  report["job"] = *last;
  return print(talk, report,
               {"job " + std::to_string(job) + " is done after " + duration_text(number_at(*last, "seconds"))});
}

// ---- Results ----------------------------------------------------------------------------------------------------------

Status result_file_ready(const std::string& file) { return output_ready(file, result_endings, {}); }

Expected<std::uint64_t> fetched(const DeskClient& client, std::uint64_t job, const std::string& file,
                                const std::string& kind) {
  Expected<io::AtomicFile> output = io::AtomicFile::create(file);
  if (!output) return output.error();
  std::uint64_t bytes = 0;
  Status written = Done{};
  const Status loaded = client.download(job_path(job) + "/result/" + kind, [&](std::string_view piece) {
    bytes += piece.size();
    written = output->append(piece);
    return static_cast<bool>(written);
  });
  if (!written) return written.error();
  if (!loaded) return loaded.error();
  if (Status kept = output->commit(); !kept) return kept.error();
  return bytes;
}

Expected<std::uint64_t> fetched_result(const DeskClient& client, std::uint64_t job, const std::string& file,
                                       const std::optional<double>& exposure_ev) {
  const std::string ending = ending_of(file);
  if (ending == ".lht") return fetched(client, job, file, "solution.lht");
  if (ending == ".exr" || (ending == ".png" && !exposure_ev)) return fetched(client, job, file, "image" + ending);
  const std::string radiance = file + ".part.exr";
  std::error_code error;
  const Expected<std::uint64_t> bytes = fetched(client, job, radiance, "image.exr");
  if (!bytes) return bytes.error();
  const Expected<io::Image> image = io::read_image(radiance);
  std::filesystem::remove(radiance, error);
  if (!image) return image.error();
  if (Status written = io::write_image(file, image->view(), {exposure_ev}); !written) return written.error();
  return std::filesystem::file_size(file, error);
}

Status fetch_result(const DeskClient& client, std::uint64_t job, const std::string& file,
                    const std::optional<double>& exposure_ev, const OutputOptions& talk) {
  if (Status ready = result_file_ready(file); !ready) return ready;
  const Expected<std::uint64_t> bytes = fetched_result(client, job, file, exposure_ev);
  if (!bytes) return bytes.error();
  nlohmann::json report = document("jobs");
  report["action"] = "result", report["job"] = job, report["output"] = file, report["bytes"] = *bytes;
  return print(talk, report, {file + ": " + grouped(*bytes) + " bytes"});
}

}  // namespace lichthof::apps
