/// How messages cross a network: the type-id block and `inspect`. Every message travels as one run of bytes (codec.hpp),
/// which CAF copies as a block; inside a process nothing is ever serialised.
#pragma once

#include <algorithm>
#include <concepts>
#include <variant>

#include "actors/codec.hpp"
#include "actors/interfaces.hpp"

namespace lichthof {

namespace actors {
template <class M, class V>
constexpr bool is_one_of = false;
template <class M, class... A>
constexpr bool is_one_of<M, std::variant<A...>> = (std::same_as<M, A> || ...);

/// Bytes as a length and a block. Memory grows with what has really arrived, not with what was announced.
template <class Inspector>
caf::error inspect_bytes(Inspector& f, std::vector<std::uint8_t>& bytes) {
  auto length = static_cast<std::uint32_t>(bytes.size());
  if (auto error = f(length)) return error;
  if constexpr (std::is_base_of_v<caf::serializer, Inspector>) {
    return length > 0 ? f.apply_raw(length, bytes.data()) : caf::error{};
  } else {
    if (length > max_message_bytes) return caf::sec::invalid_argument;
    constexpr std::uint32_t piece = 1u << 20;
    bytes.clear();
    for (std::uint32_t at = 0; at < length; at += piece) {
      const std::uint32_t part = std::min(piece, length - at);
      bytes.resize(at + part);
      if (auto error = f.apply_raw(part, bytes.data() + at)) return error;
    }
    return {};
  }
}
}  // namespace actors

template <class Inspector, class M>
requires(actors::is_one_of<M, Message>) typename Inspector::result_type inspect(Inspector& f, M& message) {
  if constexpr (std::is_base_of_v<caf::serializer, Inspector>) {
    std::vector<std::uint8_t> bytes = actors::encode(message);
    return actors::inspect_bytes(f, bytes);
  } else if constexpr (std::is_base_of_v<caf::deserializer, Inspector>) {
    std::vector<std::uint8_t> bytes;
    if (auto error = actors::inspect_bytes(f, bytes)) return error;
    Expected<Message> decoded = actors::decode(bytes);
    if (!decoded || !std::holds_alternative<M>(*decoded)) return caf::sec::invalid_argument;
    message = std::get<M>(std::move(*decoded));
    return caf::none;
  } else {  // only ever shown
    return f(caf::meta::type_name("message"));
  }
}

namespace actors {

template <class Inspector>
typename Inspector::result_type inspect(Inspector& f, Introduction& introduction) {
  std::vector<HemicubeSink> cells;
  if (introduction.cells) cells = *introduction.cells;
  if constexpr (std::is_base_of_v<caf::deserializer, Inspector>) {
    if (auto error = f(introduction.controller, cells)) return error;
    introduction.cells = std::make_shared<const std::vector<HemicubeSink>>(std::move(cells));
    return caf::none;
  } else {
    return f(caf::meta::type_name("Introduction"), introduction.controller, cells);
  }
}

template <class Inspector>
typename Inspector::result_type inspect(Inspector& f, Enlistment& enlistment) {
  return f(caf::meta::type_name("Enlistment"), enlistment.worker.value, enlistment.sink);
}

}  // namespace actors
}  // namespace lichthof

// Names are the protocol: they stand in every message between processes.
CAF_BEGIN_TYPE_ID_BLOCK(lichthof, first_custom_type_id)
CAF_ADD_TYPE_ID(lichthof, (lichthof::HemicubeMessage))
CAF_ADD_TYPE_ID(lichthof, (lichthof::StartRadiosity))
CAF_ADD_TYPE_ID(lichthof, (lichthof::CellReady))
CAF_ADD_TYPE_ID(lichthof, (lichthof::CellReport))
CAF_ADD_TYPE_ID(lichthof, (lichthof::PollCell))
CAF_ADD_TYPE_ID(lichthof, (lichthof::StopRadiosity))
CAF_ADD_TYPE_ID(lichthof, (lichthof::GeometryChange))
CAF_ADD_TYPE_ID(lichthof, (lichthof::JobRequest))
CAF_ADD_TYPE_ID(lichthof, (lichthof::JobAssignment))
CAF_ADD_TYPE_ID(lichthof, (lichthof::ColumnResult))
CAF_ADD_TYPE_ID(lichthof, (lichthof::Stop))
CAF_ADD_TYPE_ID(lichthof, (lichthof::actors::Introduction))
CAF_ADD_TYPE_ID(lichthof, (lichthof::actors::Enlistment))
CAF_END_TYPE_ID_BLOCK(lichthof)
