/// The wire form of a hemicube bitmap; the only file with <zstd.h>.
///
///     bytes 0..1   resolution R, little-endian
///     bytes 2..5   length of the rest, little-endian
///     rest         one zstd frame of known content size; its content is a list of runs, or where that would not be
///                  shorter the words of the bitmap, little-endian (recognised by their length)
///
/// The runs are those of the bitmap's change from row to row: pixel p holds bit p exclusive-or bit p - R. Silhouettes
/// run on from row to row, so few runs are left. Lengths alternate between 0 and 1, beginning with 0, 7 bits a byte,
/// low ones first. Half of office.obj (1005 polygons) seen from 284 shooters, mean bytes at R = 128 / 256, zstd level
/// 1: words 223 / 427, words transposed 203 / 358, runs 198 / 382, runs of the change 149 / 236. Level 9 saves less
/// than a byte on the latter.
#include <zstd.h>

#include <bit>
#include <optional>
#include <string>

#include "core/base/check.hpp"
#include "core/light/hemicube_bitmap.hpp"

namespace lichthof {
namespace {

constexpr std::size_t header_bytes = 6;
constexpr int zstd_level = 1;

using Bytes = std::vector<std::uint8_t>;
using Words = std::vector<std::uint64_t>;

std::size_t word_bytes(std::uint32_t resolution) { return (pixel_count(resolution) + 63) / 64 * 8; }

/// The 64 bits from bit 64 word - R on: the pixels a row before those of the word; bits before the first are 0.
std::uint64_t row_before(const Words& words, std::size_t word, std::uint32_t resolution) {
  const auto start = static_cast<std::int64_t>(64 * word) - resolution;
  if (start <= -64) return 0;
  if (start < 0) return words[0] << -start;
  const auto at = static_cast<std::size_t>(start) >> 6;
  const auto shift = static_cast<std::uint32_t>(start & 63);
  return shift == 0 ? words[at] : (words[at] >> shift) | (words[at + 1] << (64 - shift));
}

void append_length(Bytes& bytes, std::uint32_t length) {
  for (; length >= 128; length >>= 7) bytes.push_back(static_cast<std::uint8_t>(length | 128));
  bytes.push_back(static_cast<std::uint8_t>(length));
}

/// Runs of the change from row to row; nothing when they are not shorter than the words.
std::optional<Bytes> runs_of(const HemicubeBitmap& bitmap) {
  const std::uint32_t resolution = bitmap.resolution(), pixels = pixel_count(resolution);
  const std::size_t limit = word_bytes(resolution);
  Bytes runs;
  std::uint32_t run_start = 0;
  std::uint64_t carry = 0;  // last bit of the word before
  for (std::size_t i = 0; i < bitmap.words().size(); ++i) {
    const std::uint64_t change = bitmap.words()[i] ^ row_before(bitmap.words(), i, resolution);
    std::uint64_t starts = change ^ (change << 1 | carry);
    carry = change >> 63;
    for (; starts != 0; starts &= starts - 1) {
      const auto pixel = static_cast<std::uint32_t>(64 * i) + static_cast<std::uint32_t>(std::countr_zero(starts));
      if (pixel >= pixels) break;
      append_length(runs, pixel - run_start);
      run_start = pixel;
    }
    if (runs.size() >= limit) return std::nullopt;
  }
  append_length(runs, pixels - run_start);
  if (runs.size() >= limit) return std::nullopt;
  return runs;
}

Bytes bytes_of(const Words& words) {
  Bytes bytes;
  bytes.reserve(words.size() * 8);
  for (const std::uint64_t word : words) {
    for (int shift = 0; shift < 64; shift += 8) bytes.push_back(static_cast<std::uint8_t>(word >> shift));
  }
  return bytes;
}

/// Inverse of runs_of. @returns false unless the runs end exactly with the last pixel
bool cover_runs(const Bytes& runs, HemicubeBitmap& change) {
  const std::uint32_t pixels = pixel_count(change.resolution());
  std::uint32_t pixel = 0, length = 0;
  int shift = 0;
  bool covered = false;
  for (const std::uint8_t byte : runs) {
    if (shift > 21) return false;  // four bytes hold any length
    length |= static_cast<std::uint32_t>(byte & 127) << shift;
    shift += 7;
    if (byte & 128) continue;
    if (length > pixels - pixel) return false;
    if (covered) change.cover_run(pixel, pixel + length);
    pixel += length;
    covered = !covered;
    length = 0, shift = 0;
  }
  return shift == 0 && pixel == pixels;
}

/// Change from row to row back to the rows themselves.
void sum_rows(Words& words, std::uint32_t resolution) {
  for (std::size_t i = 0; i < words.size(); ++i) {
    if (resolution >= 64) {
      words[i] ^= row_before(words, i, resolution);
      continue;
    }
    // Rows shorter than a word: the first from the word before, the others by doubling.
    std::uint64_t word = words[i];
    if (i > 0) word ^= words[i - 1] >> (64 - resolution);
    for (std::uint32_t shift = resolution; shift < 64; shift *= 2) word ^= word << shift;
    words[i] = word;
  }
}

Error broken(const std::string& what) {
  return {ErrorCode::bad_input, "hemicube bitmap", what + "; the message is damaged or from another version"};
}

}  // namespace

std::vector<std::uint8_t> packed(const HemicubeBitmap& bitmap) {
  MUST(bitmap.resolution() > 0);
  const std::optional<Bytes> runs = runs_of(bitmap);
  const Bytes content = runs ? *runs : bytes_of(bitmap.words());
  Bytes bytes(header_bytes + ZSTD_compressBound(content.size()));
  const std::size_t length = ZSTD_compress(bytes.data() + header_bytes, bytes.size() - header_bytes, content.data(),
                                           content.size(), zstd_level);
  MUST(!ZSTD_isError(length));
  bytes.resize(header_bytes + length);
  for (std::size_t i = 0; i < 2; ++i) bytes[i] = static_cast<std::uint8_t>(bitmap.resolution() >> (8 * i));
  for (std::size_t i = 0; i < 4; ++i) bytes[2 + i] = static_cast<std::uint8_t>(length >> (8 * i));
  return bytes;
}

Expected<HemicubeBitmap> unpacked(const std::vector<std::uint8_t>& bytes) {
  if (bytes.size() < header_bytes) return broken("shorter than its header");
  const std::uint32_t resolution = bytes[0] | static_cast<std::uint32_t>(bytes[1]) << 8;
  std::size_t length = 0;
  for (std::size_t i = 0; i < 4; ++i) length |= static_cast<std::size_t>(bytes[2 + i]) << (8 * i);
  if (resolution < HemicubeBitmap::min_resolution || resolution > HemicubeBitmap::max_resolution ||
      resolution % 2 != 0) {
    return broken("resolution " + std::to_string(resolution) + " is not an even number from 8 to 1024");
  }
  const std::uint8_t* frame = bytes.data() + header_bytes;
  if (length != bytes.size() - header_bytes || ZSTD_findFrameCompressedSize(frame, length) != length) {
    return broken("length does not match its header");
  }
  // An unknown size is a very large number here, so it is refused as well.
  const unsigned long long size = ZSTD_getFrameContentSize(frame, length);
  if (size > word_bytes(resolution)) return broken("more content than pixels");
  Bytes content(static_cast<std::size_t>(size));
  if (ZSTD_decompress(content.data(), content.size(), frame, length) != content.size())
    return broken("not decompressible");

  HemicubeBitmap bitmap(resolution);
  Words& words = bitmap.words_;
  const std::uint64_t padding = pixel_count(resolution) % 64 == 0 ? 0 : ~0ull << (pixel_count(resolution) % 64);
  if (content.size() == word_bytes(resolution)) {
    for (std::size_t i = 0; i < content.size(); ++i)
      words[i / 8] |= static_cast<std::uint64_t>(content[i]) << (8 * (i % 8));
    if ((words.back() & padding) != 0) return broken("covers pixels beyond the last");
    return bitmap;
  }
  if (!cover_runs(content, bitmap)) return broken("runs do not end with the last pixel");
  sum_rows(words, resolution);
  words.back() &= ~padding;
  return bitmap;
}

}  // namespace lichthof
