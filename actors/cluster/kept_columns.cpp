#include "actors/cluster/kept_columns.hpp"

#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "actors/wire_codec.hpp"

namespace lichthof::actors {

namespace {

/// One column; its checksum follows.
struct Record {
  std::uint32_t column = 0;
  std::uint64_t rays = 0;
  std::vector<float> pixels;
};

constexpr std::uint32_t max_floats = 3u << 16;
constexpr std::size_t checksum_bytes = 8;

/// FNV-1a: against records cut off or never written, not against malice.
std::uint64_t checksum(std::span<const std::uint8_t> bytes) {
  std::uint64_t sum = 0xcbf29ce484222325;
  for (const std::uint8_t byte : bytes) sum = (sum ^ byte) * 0x100000001b3;
  return sum;
}

Bytes head_of(const std::string& key) {
  Bytes bytes{'L', 'H', 'C', 1};
  WireWriter writer(bytes);
  writer(key);
  return bytes;
}

Error unwritable(const std::string& path) { return {ErrorCode::io, path, "can not be written; is the disk full?"}; }

}  // namespace

template <class Codec>
static void fields(Codec& c, Field<Codec, Record> record) {
  auto& [column, rays, pixels] = record;
  c(column, rays);
  c.list(pixels, max_floats);
}

Expected<KeptColumns> KeptColumns::open(const std::string& path, const std::string& key, std::uint32_t columns,
                                        std::uint32_t height) {
  KeptColumns kept(path, columns, height);
  std::ifstream in(path, std::ios::binary);
  const Bytes bytes{std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
  in.close();
  const Bytes head = head_of(key);
  const bool is_ours = bytes.size() >= head.size() && std::equal(head.begin(), head.end(), bytes.begin());
  std::error_code error;
  if (is_ours) {
    const std::size_t good = head.size() + kept.read(std::span(bytes).subspan(head.size()));
    if (good < bytes.size()) std::filesystem::resize_file(path, good, error);
  } else {
    std::ofstream out(path, std::ios::binary | std::ios::trunc);
    out.write(reinterpret_cast<const char*>(head.data()), static_cast<std::streamsize>(head.size()));
    if (!out.flush()) return unwritable(path);
  }
  if (error) return unwritable(path);
  return kept;
}

/// @returns how many bytes of it are sound
std::size_t KeptColumns::read(std::span<const std::uint8_t> bytes) {
  const std::size_t size = sizeof(std::uint32_t) + sizeof(std::uint64_t) + sizeof(std::uint32_t) +
                           sizeof(float) * 3 * height_ + checksum_bytes;
  std::size_t at = 0;
  for (; at + size <= bytes.size(); at += size) {
    const auto body = bytes.subspan(at, size - checksum_bytes);
    std::uint64_t expected = 0;
    WireReader(bytes.subspan(at + body.size(), checksum_bytes))(expected);
    if (expected != checksum(body)) break;
    Record record;
    WireReader reader(body);
    reader(record);
    if (reader.refused() || !reader.at_end() || record.column >= is_kept_.size() || is_kept_[record.column]) break;
    is_kept_[record.column] = 1;
    ColumnResult result{WorkerId{}, {record.column, record.column + 1}, {}, {record.rays}, 0};
    for (std::size_t row = 0; row < height_; ++row)
      result.pixels.emplace_back(record.pixels[3 * row], record.pixels[3 * row + 1], record.pixels[3 * row + 2]);
    found_.push_back(std::move(result));
  }
  return at;
}

Status KeptColumns::add(std::uint32_t column, std::span<const Rgbf> pixels, std::uint64_t rays) {
  Record record{column, rays, {}};
  for (const Rgbf& pixel : pixels) record.pixels.insert(record.pixels.end(), {pixel.x, pixel.y, pixel.z});
  Bytes bytes;
  WireWriter writer(bytes);
  writer(record);
  writer(checksum(bytes));
  std::ofstream out(path_, std::ios::binary | std::ios::app);
  out.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  if (!out.flush()) return unwritable(path_);
  is_kept_[column] = 1;
  return Done{};
}

}  // namespace lichthof::actors
