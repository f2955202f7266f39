/// The other side of the desk: one question, one answer or one clear line of error. Verifies that it speaks with a controller
/// of the user's lab.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

#include "actors/link/tls.hpp"
#include "core/base/expected.hpp"

namespace lichthof::apps {

/// Where a desk is and how to speak to it.
struct DeskAddress {
  std::string host = "127.0.0.1";
  std::uint16_t port = 0;
  std::shared_ptr<const actors::TlsContext> tls;  ///< none: in the clear
};

/// Reads "HOST", "HOST:PORT", "[ADDRESS]:PORT". @error bad_input naming `where`
Expected<DeskAddress> desk_address(const std::string& text, const std::string& where);

class DeskClient {
 public:
  explicit DeskClient(DeskAddress address) : address_(std::move(address)) {}

  // Each @error: bad_input where the desk says 400 or 404, else failed; `where` is its endpoint.
  Expected<nlohmann::json> get(const std::string& path) const;
  Expected<nlohmann::json> post(const std::string& path, const nlohmann::json& body = nlohmann::json::object()) const;
  Expected<std::string> text(const std::string& path) const;
  /// Hands on the bytes of an answer as they come. @param take  false: no more of it
  Status download(const std::string& path, const std::function<bool(std::string_view)>& take) const;
  Expected<bool> has_scene(const std::string& hash) const;
  /// @param sent  told the share that has gone, in [0, 1]; returns false to give up
  Status upload_scene(const std::string& hash, const std::string& bytes, const std::function<bool(double)>& sent) const;

  const DeskAddress& address() const { return address_; }

 private:
  DeskAddress address_;
};

}  // namespace lichthof::apps
