#include "actors/cluster/lead_file.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "actors/wire_codec.hpp"

namespace lichthof::actors {

namespace {

constexpr std::uint8_t version = 2;
constexpr std::uint32_t max_entries = 1u << 24, max_cells_of_job = 1u << 17, max_numbers = 1u << 8;

struct NamedJob {
  JobId id;
  KeptJob job;
};

}  // namespace

template <>
inline constexpr std::size_t least_bytes<JournalEntry> = 6;
template <>
inline constexpr std::size_t least_bytes<NamedJob> = 77;

template <class Codec>
static void fields(Codec& c, Field<Codec, JobWish> wish) {
  auto& [title, radiosity, picture, grid, patches, bytes_per_patch, base_bytes, priority] = wish;
  auto unsigned_priority = static_cast<std::uint32_t>(priority);
  c(title, radiosity, picture, grid[0], grid[1], grid[2], bytes_per_patch, base_bytes, unsigned_priority);
  c.list(patches, max_cells_of_job);
  if constexpr (Codec::reads) priority = static_cast<std::int32_t>(unsigned_priority);
}
template <class Codec>
static void fields(Codec& c, Field<Codec, journal::Submitted> entry) {
  auto& [job, wish] = entry;
  c(job, wish);
}
template <class Codec>
static void fields(Codec& c, Field<Codec, journal::EpochBegun> entry) {
  auto& [job, epoch] = entry;
  c(job, epoch);
}
template <class Codec>
static void fields(Codec& c, Field<Codec, journal::CheckpointKept> entry) {
  auto& [job] = entry;
  c(job);
}
template <class Codec>
static void fields(Codec& c, Field<Codec, journal::NodeLost> entry) {
  auto& [job, name] = entry;
  c(job, name);
}
template <class Codec>
static void fields(Codec& c, Field<Codec, journal::PassFinished> entry) {
  auto& [job, pass] = entry;
  auto kind = static_cast<std::uint8_t>(pass);
  c(job, kind);
  if constexpr (Codec::reads) {
    if (kind > 1) return c.refuse();
    pass = static_cast<Pass>(kind);
  }
}
template <class Codec>
static void fields(Codec& c, Field<Codec, journal::Ended> entry) {
  auto& [job, state, reason] = entry;
  auto kind = static_cast<std::uint8_t>(state);
  c(job, kind, reason);
  if constexpr (Codec::reads) {
    if (kind > static_cast<std::uint8_t>(JobState::cancelled)) return c.refuse();
    state = static_cast<JobState>(kind);
  }
}
template <class Codec>
static void fields(Codec& c, Field<Codec, journal::Retried> entry) {
  auto& [job] = entry;
  c(job);
}

template <class Codec>
static void fields(Codec& c, Field<Codec, journal::Forgotten> entry) {
  auto& [job] = entry;
  c(job);
}
template <class Codec>
static void fields(Codec& c, Field<Codec, journal::Numbered> entry) {
  auto& [job] = entry;
  c(job);
}
template <class Codec>
static void fields(Codec& c, Field<Codec, journal::Draining> entry) {
  auto& [node, is_draining] = entry;
  c(node, is_draining);
}

template <std::size_t K = 0>
static bool make_kind(std::size_t kind, JournalEntry& entry) {
  if constexpr (K == std::variant_size_v<JournalEntry>)
    return false;
  else if (kind == K)
    return entry.emplace<K>(), true;
  else
    return make_kind<K + 1>(kind, entry);
}
template <class Codec>
static void fields(Codec& c, Field<Codec, JournalEntry> entry) {
  auto kind = static_cast<std::uint8_t>(entry.index());
  c(kind);
  if constexpr (Codec::reads)
    if (!make_kind(kind, entry)) return c.refuse();
  std::visit([&](auto& one) { c(one); }, entry);
}
template <class Codec>
static void fields(Codec& c, Field<Codec, NamedJob> job) {
  auto& [id, kept] = job;
  auto& [order, solution, submitted_s, ended_s, is_fetched] = kept;
  auto& [wish, start, picture, eps, owner] = order;
  auto& [method, width, height, samples, gather, camera] = picture;
  c(id, solution, wish, start, method, width, height, samples, gather, eps, owner, submitted_s, ended_s, is_fetched);
  c.list(camera, max_numbers);
}

Status write_lead_file(const std::string& path, const LeadFile& file) {
  Bytes bytes{'L', 'H', 'L', version};
  WireWriter writer(bytes);
  writer.list(file.journal, max_entries);
  std::vector<NamedJob> jobs;
  for (const auto& [id, job] : file.jobs) jobs.push_back({id, job});
  writer.list(jobs, max_entries);
  const std::string partial = path + ".part";
  const int fd = ::open(partial.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0600);
  bool good = fd >= 0;
  for (std::size_t at = 0; good && at < bytes.size();) {
    const ssize_t written = ::write(fd, bytes.data() + at, bytes.size() - at);
    good = written > 0;
    if (good) at += static_cast<std::size_t>(written);
  }
  good = good && ::fsync(fd) == 0;
  if (fd >= 0) ::close(fd);
  good = good && ::rename(partial.c_str(), path.c_str()) == 0;
  if (!good) return Error{ErrorCode::io, path, "can not be written; is the disk full?"};
  return Done{};
}

Expected<LeadFile> read_lead_file(const std::string& path) {
  LeadFile file;
  std::error_code error;
  if (!std::filesystem::exists(path, error)) return file;
  std::ifstream in(path, std::ios::binary);
  const Bytes bytes{std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
  const auto refused = [&] {
    return Error{ErrorCode::bad_input, path,
                 "is damaged or of another version; move it away to begin without its jobs"};
  };
  if (!in || bytes.size() < 4 || bytes[0] != 'L' || bytes[1] != 'H' || bytes[2] != 'L' || bytes[3] != version)
    return refused();
  WireReader reader(std::span<const std::uint8_t>(bytes).subspan(4));
  reader.list(file.journal, max_entries);
  std::vector<NamedJob> jobs;
  reader.list(jobs, max_entries);
  if (reader.refused() || !reader.at_end()) return refused();
  for (NamedJob& job : jobs) file.jobs[job.id] = std::move(job.job);
  return file;
}

}  // namespace lichthof::actors
