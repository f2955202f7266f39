#include "io/atomic_file.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <system_error>

namespace lichthof::io {

namespace fs = std::filesystem;

namespace {

constexpr std::size_t buffer_bytes = 1 << 20;

Error cannot_write(const std::string& path, const std::string& what, int code) {
  return {ErrorCode::io, path, what + ": " + std::strerror(code)};
}

/// Where a chain of symbolic links leads, so that writing through a link keeps the link.
fs::path link_target(const std::string& path) {
  std::error_code problem;
  fs::path target(path);
  for (int hops = 0; hops < 40 && fs::is_symlink(target, problem); ++hops) {
    const fs::path next = fs::read_symlink(target, problem);
    if (problem) break;
    target = next.is_absolute() ? next : target.parent_path() / next;
  }
  return target;
}

/// A hidden name beside the target that no other process or thread of ours uses.
std::string temporary_name(const fs::path& target) {
  static std::atomic<unsigned> counter{0};
  const std::string suffix = "." + std::to_string(::getpid()) + "-" + std::to_string(counter++) + ".tmp";
  // File names end at 255 bytes; a longer target name could not have been created either way.
  return (target.parent_path() / ("." + target.filename().string().substr(0, 200) + suffix)).string();
}

}  // namespace

AtomicFile::AtomicFile(std::string path, std::string temporary, int fd)
    : path_(std::move(path)), temporary_(std::move(temporary)), fd_(fd) {}

AtomicFile::AtomicFile(AtomicFile&& other) noexcept
    : path_(std::move(other.path_)), target_(std::move(other.target_)), temporary_(std::move(other.temporary_)),
      buffer_(std::move(other.buffer_)), fd_(std::exchange(other.fd_, -1)), failed_(other.failed_),
      error_(std::move(other.error_)) {
  other.temporary_.clear();
}

AtomicFile::~AtomicFile() {
  if (fd_ >= 0) ::close(fd_);
  if (!temporary_.empty()) ::unlink(temporary_.c_str());
}

Expected<AtomicFile> AtomicFile::create(const std::string& path) {
  if (path.empty()) return Error{ErrorCode::bad_input, "", "the output file has no name"};
  const fs::path target = link_target(path);
  struct stat info {};
  const bool exists = ::stat(target.c_str(), &info) == 0;
  if (exists && S_ISDIR(info.st_mode)) return cannot_write(path, "cannot be written", EISDIR);
  if (exists && !S_ISREG(info.st_mode)) {
    const int fd = ::open(target.c_str(), O_WRONLY | O_CLOEXEC);
    if (fd < 0) return cannot_write(path, "cannot be written", errno);
    return AtomicFile(path, "", fd);
  }
  // Renaming only needs the folder; a file that was made read-only on purpose is respected all the same.
  if (exists && ::access(target.c_str(), W_OK) != 0) return cannot_write(path, "cannot be written", errno);
  const std::string temporary = temporary_name(target);
  const int fd = ::open(temporary.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
  if (fd < 0) return cannot_write(path, "cannot be written", errno);
  if (exists) (void)!::fchmod(fd, info.st_mode & 07777);
  AtomicFile file(path, temporary, fd);
  file.target_ = target.string();
  return file;
}

Error AtomicFile::failure(const char* what, int code) {
  failed_ = true;
  return error_ = cannot_write(path_, what, code);
}

Status AtomicFile::drain(std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t written = ::write(fd_, bytes.data(), bytes.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) return failure("cannot be written", errno);
    bytes.remove_prefix(static_cast<std::size_t>(written));
  }
  return Done{};
}

Status AtomicFile::append(std::string_view bytes) {
  if (failed_) return error_;
  if (buffer_.size() + bytes.size() <= buffer_bytes) {
    buffer_.append(bytes);
    return Done{};
  }
  const std::string waiting = std::exchange(buffer_, {});
  if (Status drained = drain(waiting); !drained) return drained;
  return drain(bytes);
}

Status AtomicFile::commit() {
  if (failed_) return error_;
  if (Status drained = drain(std::exchange(buffer_, {})); !drained) return drained;
  // Pipes and devices have nothing to sync: EINVAL. Everything else is a disk that lost the bytes.
  if (::fsync(fd_) != 0 && errno != EINVAL && errno != EROFS) return failure("cannot be flushed to the disk", errno);
  if (::close(std::exchange(fd_, -1)) != 0) return failure("cannot be closed", errno);
  if (temporary_.empty()) return Done{};
  if (::rename(temporary_.c_str(), target_.c_str()) != 0) return failure("cannot be put in place", errno);
  temporary_.clear();
  // The new name itself lives in the folder; a folder that cannot be synced (some network disks) is no failure.
  const std::string folder = fs::path(target_).parent_path().string();
  if (const int fd = ::open(folder.empty() ? "." : folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC); fd >= 0) {
    (void)!::fsync(fd);
    ::close(fd);
  }
  return Done{};
}

Status write_file(const std::string& path, std::string_view bytes) {
  Expected<AtomicFile> file = AtomicFile::create(path);
  if (!file) return file.error();
  if (Status written = file->append(bytes); !written) return written;
  return file->commit();
}

Status writable(const std::string& path) {
  std::error_code problem;
  const fs::path target = link_target(path);
  // Opening a pipe would wait for its reader.
  if (fs::exists(target, problem) && !fs::is_regular_file(target, problem) && !fs::is_directory(target, problem)) {
    if (::access(target.c_str(), W_OK) != 0) return cannot_write(path, "cannot be written", errno);
    return Done{};
  }
  Expected<AtomicFile> file = AtomicFile::create(path);
  if (!file) return file.error();
  return Done{};
}

}  // namespace lichthof::io
