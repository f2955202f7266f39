/// What the controller can be asked for by people, whatever serves them: the desk calls it from many threads at once, and
/// answers are JSON documents as values.
///
/// An Error becomes a status of HTTP: where a job or node is named, bad_input is "there is none" (404) and failed "not in
/// this state" (409); where bytes or a job are handed in, bad_input is 400. io is 500, interrupted 503.
#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>

#include "actors/link/role.hpp"
#include "core/base/expected.hpp"

namespace lichthof::apps {

/// Who asks, as the certificate says; in the clear everybody is the user "local", or
/// "anybody" where the desk is open beyond loopback.
struct Caller {
  std::string name;
  actors::Role role = actors::Role::viewer;
};

class LabService {
 public:
  virtual ~LabService() = default;

  /// Array: id name host state(idle|busy|slow|draining|lost) cores rays_per_s memory_bytes free_memory_bytes busy_share(0..1)
  /// bytes_in bytes_out shots rays (since it joined) version jobs[] seen_s
  virtual nlohmann::json nodes() = 0;
  /// Array: node actor kind job busy_share mailbox shots_per_s rays_per_s unshot_w bytes_in bytes_out memory_bytes state.
  /// Rates are of the last second; bytes of frames to and from other processes, since the actor began
  virtual nlohmann::json actors() = 0;
  /// Array: id title state(queued|running|done|failed|cancelled, or finer words of running) pass progress(0..1) seconds
  /// shots rays unshot_w energy reason owner nodes[] cells columns_done columns
  /// @param most_ended  of those that are over, the latest so many
  virtual nlohmann::json jobs(std::size_t most_ended = SIZE_MAX) = 0;
  virtual Expected<nlohmann::json> job(std::uint64_t id) = 0;

  /// @param hash  actors::sha256_of(bytes)
  virtual bool has_scene(const std::string& hash) = 0;
  /// @param bytes  io::scene_parcel. @returns its hash
  virtual Expected<std::string> add_scene(const std::string& bytes) = 0;
  /// @param spec  {"scene": hash, "title": text, "options": {...}}. Options, all but camera and size optional: method cells
  ///              eps hemicube elements patch_m element_m samples gather width height
  ///              camera{name eye[3] target[3] up[3] fov_deg} (metres, z up)
  virtual Expected<std::uint64_t> submit(const nlohmann::json& spec, const Caller& caller) = 0;
  virtual Status cancel(std::uint64_t job) = 0;
  virtual Status resume(std::uint64_t job) = 0;
  /// @param on  false: takes work again
  virtual Status drain(const std::string& node, bool on) = 0;
  virtual Status kick(const std::string& node) = 0;

  /// @param kind  "image.exr", "image.png", "solution.lht"
  virtual Expected<std::string> result(std::uint64_t job, const std::string& kind) = 0;
  /// Plain text, a line per event.
  virtual Expected<std::string> log(std::uint64_t job) = 0;
  /// Array: name text
  virtual nlohmann::json methods() = 0;
  /// In the text format of Prometheus.
  virtual std::string metrics() = 0;
  /// PNG, black where columns are missing.
  virtual Expected<std::string> picture_so_far(std::uint64_t job) = 0;
};

/// States in which a job changes no more.
inline bool is_over(const std::string& state) { return state == "done" || state == "failed" || state == "cancelled"; }

}  // namespace lichthof::apps
