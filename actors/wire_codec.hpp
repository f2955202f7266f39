/// Values to bytes and back for everything that crosses a network. Both directions share one list of fields per structure:
/// `template <class Codec> void fields(Codec& c, Field<Codec, T> value)`, found beside the codec that uses it. The reader trusts
/// no length: nothing is allocated that the bytes left could not fill, and after the first thing wrong it refuses.
#pragma once

#include <bit>
#include <cstdint>
#include <span>
#include <string>
#include <type_traits>
#include <vector>

#include "core/base/check.hpp"

namespace lichthof::actors {

using Bytes = std::vector<std::uint8_t>;

constexpr std::uint32_t max_text_bytes = 1u << 12;

/// Fewest bytes an element of a list takes: what bounds the count by the bytes that are left.
template <class T>
inline constexpr std::size_t least_bytes = sizeof(T);
template <>
inline constexpr std::size_t least_bytes<std::string> = 4;

class WireWriter {
 public:
  static constexpr bool reads = false;
  explicit WireWriter(Bytes& bytes) : bytes_(bytes) {}
  template <class... T>
  void operator()(const T&... values) {
    (value(values), ...);
  }
  template <class T>
  void list(const std::vector<T>& values, std::uint32_t most) {
    MUST(values.size() <= most);
    value(static_cast<std::uint32_t>(values.size()));
    if constexpr (std::is_same_v<T, std::uint8_t>)
      bytes_.insert(bytes_.end(), values.begin(), values.end());
    else
      for (const T& one : values) value(one);
  }

 private:
  template <class T>
  void value(const T& v);
  Bytes& bytes_;
};

class WireReader {
 public:
  static constexpr bool reads = true;
  explicit WireReader(std::span<const std::uint8_t> bytes) : bytes_(bytes) {}
  template <class... T>
  void operator()(T&... values) {
    (value(values), ...);
  }
  template <class T>
  void list(std::vector<T>& values, std::uint32_t most) {
    std::uint32_t count = 0;
    value(count);
    if (count > most || count > bytes_.size() / least_bytes<T>) return refuse();
    if constexpr (std::is_same_v<T, std::uint8_t>) {
      values.assign(bytes_.begin(), bytes_.begin() + count);
      bytes_ = bytes_.subspan(count);
    } else {
      values.resize(count);
      for (T& one : values) {
        if (refused_) return;
        value(one);
      }
    }
  }
  void refuse() {
    refused_ = true;
    bytes_ = {};
  }
  bool refused() const { return refused_; }
  bool at_end() const { return bytes_.empty(); }

 private:
  template <class T>
  void value(T& v);
  std::span<const std::uint8_t> bytes_;
  bool refused_ = false;
};

/// A message to be written, or one to be filled in.
template <class Codec, class T>
using Field = std::conditional_t<Codec::reads, T&, const T&>;

// ---- Values -----------------------------------------------------------------------------------------------------------

template <class T>
void WireWriter::value(const T& v) {
  if constexpr (std::is_same_v<T, bool>) {
    bytes_.push_back(v ? 1 : 0);
  } else if constexpr (std::is_unsigned_v<T>) {
    for (std::size_t i = 0; i < sizeof(T); ++i) bytes_.push_back(static_cast<std::uint8_t>(v >> (8 * i)));
  } else if constexpr (std::is_same_v<T, float>) {
    value(std::bit_cast<std::uint32_t>(v));
  } else if constexpr (std::is_same_v<T, double>) {
    value(std::bit_cast<std::uint64_t>(v));
  } else if constexpr (std::is_same_v<T, std::string>) {
    MUST(v.size() <= max_text_bytes);
    value(static_cast<std::uint32_t>(v.size()));
    bytes_.insert(bytes_.end(), v.begin(), v.end());
  } else if constexpr (requires { v.value; }) {
    value(v.value);
  } else {
    fields(*this, v);
  }
}

template <class T>
void WireReader::value(T& v) {
  if constexpr (std::is_same_v<T, bool>) {
    std::uint8_t byte = 0;
    value(byte);
    if (byte > 1) return refuse();
    v = byte == 1;
  } else if constexpr (std::is_unsigned_v<T>) {
    if (bytes_.size() < sizeof(T)) return refuse();
    v = 0;
    for (std::size_t i = 0; i < sizeof(T); ++i) v = static_cast<T>(v | static_cast<T>(bytes_[i]) << (8 * i));
    bytes_ = bytes_.subspan(sizeof(T));
  } else if constexpr (std::is_same_v<T, float>) {
    std::uint32_t bits = 0;
    value(bits);
    v = std::bit_cast<float>(bits);
  } else if constexpr (std::is_same_v<T, double>) {
    std::uint64_t bits = 0;
    value(bits);
    v = std::bit_cast<double>(bits);
  } else if constexpr (std::is_same_v<T, std::string>) {
    std::uint32_t size = 0;
    value(size);
    if (size > max_text_bytes || size > bytes_.size()) return refuse();
    v.assign(bytes_.begin(), bytes_.begin() + size);
    bytes_ = bytes_.subspan(size);
  } else if constexpr (requires { v.value; }) {
    value(v.value);
  } else {
    fields(*this, v);
  }
}

}  // namespace lichthof::actors
