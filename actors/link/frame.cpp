#include "actors/link/frame.hpp"

#include <algorithm>
#include <type_traits>

namespace lichthof::actors {

namespace {

constexpr std::uint64_t magic = 0x4b4e494c4f48434cULL;  // "LCHOLINK" in memory
constexpr std::size_t max_version_bytes = 64;

template <class T>
void put(Bytes& out, T value) {
  static_assert(std::is_unsigned_v<T>);
  for (std::size_t i = 0; i < sizeof(T); ++i) out.push_back(static_cast<std::uint8_t>(value >> (8 * i)));
}

/// Reads fields one after the other; past the end everything is zero and `good` is false.
class Fields {
 public:
  explicit Fields(const Bytes& bytes) : left_(bytes) {}
  template <class T>
  T number() {
    T value = 0;
    if (left_.size() < sizeof(T)) return refuse(), value;
    for (std::size_t i = 0; i < sizeof(T); ++i) value = static_cast<T>(value | static_cast<T>(left_[i]) << (8 * i));
    left_ = left_.subspan(sizeof(T));
    return value;
  }
  std::string text(std::size_t most) {
    const std::size_t length = number<std::uint8_t>();
    if (length > most || length > left_.size()) return refuse(), std::string();
    std::string text(left_.begin(), left_.begin() + static_cast<std::ptrdiff_t>(length));
    left_ = left_.subspan(length);
    return text;
  }
  bool good() const { return good_; }
  bool at_end() const { return left_.empty(); }

 private:
  void refuse() {
    good_ = false;
    left_ = {};
  }
  std::span<const std::uint8_t> left_;
  bool good_ = true;
};

void put_text(Bytes& out, std::string_view text) {
  out.push_back(static_cast<std::uint8_t>(text.size()));
  out.insert(out.end(), text.begin(), text.end());
}

Error refused(std::string what) { return {ErrorCode::bad_input, "", std::move(what)}; }

std::string printable(std::string text) {
  for (char& c : text)
    if (c < ' ' || c > '~') c = '?';
  return text;
}

/// Payloads of a kind end here.
std::size_t longest(FrameKind kind, std::size_t max_frame_bytes) {
  switch (kind) {
    case FrameKind::hello:
      return max_greeting_bytes - frame_header_bytes;
    case FrameKind::ready:
      return 0;
    case FrameKind::goodbye:
      return max_reason_bytes;
    case FrameKind::control:
    case FrameKind::bulk:
      return max_frame_bytes;
    case FrameKind::credit:
    case FrameKind::ping:
    case FrameKind::pong:
      return 8;
  }
  return 0;
}

}  // namespace

void put_header(Bytes& out, std::size_t length, FrameKind kind) {
  put(out, static_cast<std::uint32_t>(length));
  out.push_back(static_cast<std::uint8_t>(kind));
}

Bytes number_frame(FrameKind kind, std::uint64_t number) {
  Bytes out;
  put_header(out, 8, kind);
  put(out, number);
  return out;
}

Bytes goodbye_frame(std::string_view reason) {
  reason = reason.substr(0, max_reason_bytes);
  Bytes out;
  put_header(out, reason.size(), FrameKind::goodbye);
  out.insert(out.end(), reason.begin(), reason.end());
  return out;
}

std::optional<std::uint64_t> number_in(const Frame& frame) {
  if (frame.bytes->size() != 8) return std::nullopt;
  return Fields(*frame.bytes).number<std::uint64_t>();
}

std::string reason_in(const Frame& frame) { return printable(std::string(frame.bytes->begin(), frame.bytes->end())); }

Status FrameReader::look_at_header() {
  length_ = 0;
  for (std::size_t i = 0; i < 4; ++i) length_ |= static_cast<std::size_t>(header_[i]) << (8 * i);
  // The records of TLS begin with these; whoever mixes up the two should be told so.
  if (max_frame_bytes_ == 0 && (header_[0] == 0x15 || header_[0] == 0x16) && header_[1] == 3)
    return refused("the peer speaks TLS and this end does not");
  const auto kind = static_cast<FrameKind>(header_[4]);
  if (kind < FrameKind::hello || kind > FrameKind::goodbye)
    return refused(max_frame_bytes_ == 0 ? "not a peer of lichthof"
                                         : "a frame of unknown kind " + std::to_string(header_[4]));
  if (max_frame_bytes_ == 0 && kind != FrameKind::hello && kind != FrameKind::goodbye && kind != FrameKind::ready)
    return refused("a frame before the greeting");
  const std::size_t most = longest(kind, max_frame_bytes_);
  if (length_ > most)
    return refused("a frame of " + std::to_string(length_) + " bytes where " + std::to_string(most) + " are the most");
  return Done{};
}

Expected<std::optional<Frame>> FrameReader::next(std::span<const std::uint8_t>& arrived) {
  if (!payload_) {
    const std::size_t wanted = std::min(frame_header_bytes - header_bytes_, arrived.size());
    std::copy_n(arrived.begin(), wanted, header_ + header_bytes_);
    header_bytes_ += wanted;
    arrived = arrived.subspan(wanted);
    if (header_bytes_ < frame_header_bytes) return std::optional<Frame>{};
    if (Status good = look_at_header(); !good) return good.error();
    payload_ = std::make_shared<Bytes>();
    if (length_ <= arrived.size()) payload_->reserve(length_);
  }
  const std::size_t wanted = std::min(length_ - payload_->size(), arrived.size());
  payload_->insert(payload_->end(), arrived.begin(), arrived.begin() + static_cast<std::ptrdiff_t>(wanted));
  arrived = arrived.subspan(wanted);
  if (payload_->size() < length_) return std::optional<Frame>{};
  header_bytes_ = 0;
  return std::optional<Frame>{Frame{static_cast<FrameKind>(header_[4]), std::exchange(payload_, nullptr)}};
}

Bytes hello_frame(const Hello& hello) {
  Bytes payload;
  put(payload, magic);
  put(payload, hello.protocol);
  put(payload, hello.boot_id);
  put(payload, hello.port);
  put(payload, hello.bulk_window);
  put_text(payload, std::string_view(hello.version).substr(0, max_version_bytes));
  put_text(payload, hello.who.name);
  put_text(payload, name_of(hello.who.role));
  Bytes out;
  put_header(out, payload.size(), FrameKind::hello);
  out.insert(out.end(), payload.begin(), payload.end());
  return out;
}

Expected<Hello> hello_in(const Frame& frame, const std::string& own_version) {
  Fields fields(*frame.bytes);
  if (fields.number<std::uint64_t>() != magic) return refused("not a peer of lichthof");
  Hello hello;
  hello.protocol = fields.number<std::uint16_t>();
  hello.boot_id = fields.number<std::uint64_t>();
  hello.port = fields.number<std::uint16_t>();
  hello.bulk_window = fields.number<std::uint32_t>();
  hello.version = printable(fields.text(max_version_bytes));
  if (hello.protocol != link_protocol)
    return refused("the peer speaks link protocol " + std::to_string(hello.protocol) + " (lichthof " + hello.version +
                   "), this end " + std::to_string(link_protocol) + " (lichthof " + own_version +
                   "); install one version everywhere");
  hello.who.name = fields.text(max_greeting_bytes);
  const auto role = role_named(fields.text(max_greeting_bytes));
  if (!fields.good() || !fields.at_end() || !role || !is_name(hello.who.name) || hello.bulk_window == 0)
    return refused("a damaged greeting");
  hello.who.role = *role;
  return hello;
}

}  // namespace lichthof::actors
