/// The wire form of a message: bytes that mean the same on every machine. CAF's own form is not used for the contents: it
/// mangles infinities and sends vectors element by element.
///
///     byte 0    version of this form
///     byte 1    kind of message, its place in the variant Message
///     rest      the fields in the order of codec.cpp; integers and IEEE-754 bits little-endian; lists as a 32-bit count
///               and their elements; no padding
///
/// A decoder trusts nothing: every count is compared with a limit and with the bytes that are left before anything is
/// allocated, and what remains after the last field is an error. Whether the numbers make sense is the machines' business.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/base/expected.hpp"
#include "core/protocol/messages.hpp"

namespace lichthof::actors {

constexpr std::uint8_t wire_version = 2;
/// Longest message: half of an 8K picture from one worker. Longer announcements are refused.
constexpr std::uint32_t max_message_bytes = 256u << 20;

/// @pre a hemicube message has its shot
/// @cost one pass; 1.5 µs per kilobyte
std::vector<std::uint8_t> encode(const Message& message);

/// @error bad_input with what is wrong; memory for at most the given bytes is allocated
Expected<Message> decode(std::span<const std::uint8_t> bytes);

}  // namespace lichthof::actors
