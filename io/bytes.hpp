/// Values to bytes and back, little-endian. The reader trusts no length: nothing is allocated that the bytes left could not
/// fill, and after the first thing wrong everything reads as zero.
#pragma once

#include <bit>
#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

namespace lichthof::io {

static_assert(std::endian::native == std::endian::little, "the file formats are little-endian");

class ByteWriter {
 public:
  /// A number, or a vector type that is nothing but numbers of one kind (Vec3, Rgbf), which has no padding.
  template <class T>
  void put(const T& value) {
    static_assert(std::is_trivially_copyable_v<T> && !std::is_pointer_v<T>);
    bytes_.append(reinterpret_cast<const char*>(&value), sizeof value);
  }
  void put(const std::string& text) {
    put(static_cast<std::uint64_t>(text.size()));
    bytes_ += text;
  }
  template <class T>
  void put(const std::vector<T>& values) {
    static_assert(std::is_trivially_copyable_v<T>);
    put(static_cast<std::uint64_t>(values.size()));
    bytes_.append(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T));
  }
  const std::string& bytes() const { return bytes_; }

 private:
  std::string bytes_;
};

class ByteReader {
 public:
  explicit ByteReader(std::string_view bytes) : rest_(bytes) {}

  template <class T>
  void get(T& value) {
    static_assert(std::is_trivially_copyable_v<T> && !std::is_pointer_v<T>);
    if (!take(sizeof value)) return;
    std::memcpy(static_cast<void*>(&value), taken_, sizeof value);
  }
  void get(bool& value) {
    std::uint8_t byte = 0;
    get(byte);
    good_ &= byte <= 1;
    value = byte == 1;
  }
  void get(std::string& text) {
    const std::uint64_t size = count(1);
    if (take(size)) text.assign(taken_, size);
  }
  template <class T>
  void get(std::vector<T>& values) {
    static_assert(std::is_trivially_copyable_v<T>);
    const std::uint64_t size = count(sizeof(T));
    values.resize(size);
    if (size > 0 && take(size * sizeof(T))) std::memcpy(static_cast<void*>(values.data()), taken_, size * sizeof(T));
  }
  /// A count of things that take at least `least_bytes` each; 0 when there can't be so many.
  std::uint64_t count(std::size_t least_bytes) {
    std::uint64_t value = 0;
    get(value);
    if (value > rest_.size() / least_bytes) good_ = false, value = 0;
    return value;
  }
  bool good() const { return good_; }
  bool at_end() const { return rest_.empty(); }

 private:
  bool take(std::uint64_t size) {
    good_ &= size <= rest_.size();
    if (!good_) return false;
    taken_ = rest_.data();
    rest_.remove_prefix(size);
    return true;
  }

  std::string_view rest_;
  const char* taken_ = nullptr;
  bool good_ = true;
};

/// A 64-bit hash for finding damage, not malice.
inline std::uint64_t checksum(std::string_view bytes, std::uint64_t hash = 0x243F6A8885A308D3ull) {
  const auto mix = [&hash](std::uint64_t word) {
    hash = (hash ^ word) * 0x9E3779B97F4A7C15ull;
    hash ^= hash >> 32;
  };
  for (; bytes.size() >= 8; bytes.remove_prefix(8)) {
    std::uint64_t word;
    std::memcpy(&word, bytes.data(), 8);
    mix(word);
  }
  std::uint64_t tail = 0;
  if (!bytes.empty()) std::memcpy(&tail, bytes.data(), bytes.size());
  mix(tail);
  mix(bytes.size());
  return hash;
}

}  // namespace lichthof::io
