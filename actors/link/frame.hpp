/// What crosses a link: frames, and the greeting that comes first.
///
///     [u32 length of the payload][u8 kind][payload]          little-endian
///
/// The dialler greets first:  hello ──►   ◄── hello   ready ──►   and then either may send anything. The first twelve bytes of
/// a greeting's payload (magic, protocol version) keep their places in all versions to come, so that both ends can name both.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "actors/link/role.hpp"
#include "core/base/expected.hpp"

namespace lichthof::actors {

constexpr std::uint16_t link_protocol = 1;
constexpr std::size_t frame_header_bytes = 5;
/// All that may arrive from somebody who has not said who he is.
constexpr std::size_t max_greeting_bytes = 1024;
/// Of a goodbye; longer ones are cut off.
constexpr std::size_t max_reason_bytes = 240;

enum class FrameKind : std::uint8_t { hello = 1, ready, control, bulk, credit, ping, pong, goodbye };

using Bytes = std::vector<std::uint8_t>;
using SharedBytes = std::shared_ptr<const Bytes>;

struct Frame {
  FrameKind kind = FrameKind::control;
  SharedBytes bytes;
};

/// Appends the header of a frame.
void put_header(Bytes& out, std::size_t length, FrameKind kind);
/// A whole frame with a number or a text as its payload.
Bytes number_frame(FrameKind kind, std::uint64_t number);
Bytes goodbye_frame(std::string_view reason);
/// @returns nothing when the payload is no number
std::optional<std::uint64_t> number_in(const Frame& frame);
/// The text of a goodbye with everything unprintable replaced: it goes into logs.
std::string reason_in(const Frame& frame);

/// Cuts what arrives into frames. Memory grows with what has arrived, not with what was announced.
class FrameReader {
 public:
  /// Until somebody is known, greetings and goodbyes are all he may send.
  void admit(std::size_t max_frame_bytes) { max_frame_bytes_ = max_frame_bytes; }

  /// Takes bytes from the front of what arrived, until a frame is complete or nothing is left.
  /// @returns the frame, if one is complete
  /// @error   bad_input: no frame begins like this; the reader is of no use any more
  Expected<std::optional<Frame>> next(std::span<const std::uint8_t>& arrived);

 private:
  Status look_at_header();

  std::size_t max_frame_bytes_ = 0;
  std::uint8_t header_[frame_header_bytes] = {};
  std::size_t header_bytes_ = 0;
  std::size_t length_ = 0;
  std::shared_ptr<Bytes> payload_;
};

/// What each end says of itself.
struct Hello {
  std::uint16_t protocol = link_protocol;
  std::uint64_t boot_id = 0;      ///< of the process, drawn when it started
  std::uint16_t port = 0;         ///< it listens here; 0: nowhere
  std::uint32_t bulk_window = 0;  ///< bytes of bulk it is ready to hold
  std::string version;            ///< of the program
  Identity who;                   ///< under TLS the certificate decides instead
};

Bytes hello_frame(const Hello& hello);
/// @error bad_input: not one of us, or another protocol; names both versions
Expected<Hello> hello_in(const Frame& frame, const std::string& own_version);

}  // namespace lichthof::actors
