#include "actors/cluster/blob_cache.hpp"

#include <algorithm>
#include <filesystem>
#include <fstream>

#include "actors/link/digest.hpp"

namespace lichthof::actors {

namespace {

namespace fs = std::filesystem;

Error failed(const std::string& path, const char* what) { return {ErrorCode::io, path, what}; }

}  // namespace

Status BlobCache::open() {
  std::error_code error;
  fs::create_directories(folder_, error);
  if (!fs::is_directory(folder_)) return failed(folder_, "is no folder and can not be made one");
  fs::permissions(folder_, fs::perms::owner_all, error);
  // What an earlier process had not received whole.
  for (const fs::directory_entry& entry : fs::directory_iterator(folder_, error))
    if (entry.path().extension() == ".part") fs::remove(entry.path(), error);
  return Done{};
}

std::optional<std::string> BlobCache::find(const std::string& hash) const {
  std::error_code error;
  if (!is_sha256(hash) || !fs::is_regular_file(path(hash), error)) return std::nullopt;
  fs::last_write_time(path(hash), fs::file_time_type::clock::now(), error);  // used just now
  return path(hash);
}

Expected<std::string> BlobCache::adopt(const std::string& from) {
  Expected<std::string> hash = sha256_of_file(from);
  if (!hash) return hash.error();
  std::error_code error;
  fs::rename(from, path(*hash), error);
  if (error) return failed(from, "can not be moved into the cache");
  return hash;
}

Expected<std::vector<std::uint8_t>> BlobCache::part(const std::string& hash, std::uint64_t offset, std::size_t most,
                                                    std::uint64_t& total) const {
  const std::optional<std::string> found = find(hash);
  if (!found) return Error{ErrorCode::bad_input, "blob", "is not here"};
  std::ifstream file(*found, std::ios::binary | std::ios::ate);
  if (!file) return failed(*found, "can not be read");
  total = static_cast<std::uint64_t>(file.tellg());
  if (offset > total) return Error{ErrorCode::bad_input, "blob", "is not as long"};
  std::vector<std::uint8_t> bytes(static_cast<std::size_t>(std::min<std::uint64_t>(most, total - offset)));
  file.seekg(static_cast<std::streamoff>(offset));
  if (!file.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(bytes.size())))
    return failed(*found, "can not be read");
  return bytes;
}

Expected<bool> BlobCache::append(const std::string& hash, std::uint64_t offset, std::uint64_t total,
                                 std::span<const std::uint8_t> bytes) {
  if (!is_sha256(hash)) return Error{ErrorCode::bad_input, "blob", "has a name that is no hash"};
  const std::string partial = path(hash) + ".part";
  std::error_code error;
  const std::uint64_t have = fs::exists(partial, error) ? fs::file_size(partial, error) : 0;
  if (offset != have || offset + bytes.size() > total || (bytes.empty() && total > 0))
    return Error{ErrorCode::bad_input, "blob", "arrives with a gap"};
  {
    std::ofstream file(partial, std::ios::binary | std::ios::app);
    file.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
    if (!file.flush()) return failed(partial, "can not be written");
  }
  if (offset + bytes.size() < total) return false;
  const Expected<std::string> found = sha256_of_file(partial);
  if (!found) return found.error();
  if (*found != hash) {
    fs::remove(partial, error);
    return Error{ErrorCode::bad_input, "blob", "arrived damaged"};
  }
  fs::rename(partial, path(hash), error);
  if (error) return failed(partial, "can not be renamed");
  trim(hash);
  return true;
}

void BlobCache::remove(const std::string& hash) const {
  std::error_code error;
  if (is_sha256(hash)) fs::remove(path(hash), error);
}

void BlobCache::trim(const std::string& keep) const { trim_folder(folder_, most_bytes_, keep + ".lht"); }

void trim_folder(const std::string& folder, std::uint64_t most_bytes, const std::string& keep) {
  struct Kept {
    fs::file_time_type used;
    fs::path path;
    std::uint64_t bytes;
  };
  std::vector<Kept> all;
  std::uint64_t bytes = 0;
  std::error_code error;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, error)) {
    if (entry.path().extension() == ".part" || entry.path().filename() == keep) continue;
    all.push_back({entry.last_write_time(error), entry.path(), entry.file_size(error)});
    bytes += all.back().bytes;
  }
  std::sort(all.begin(), all.end(), [](const Kept& a, const Kept& b) { return a.used < b.used; });
  for (const Kept& old : all) {
    if (bytes <= most_bytes) return;
    fs::remove(old.path, error);
    bytes -= old.bytes;
  }
}

}  // namespace lichthof::actors
