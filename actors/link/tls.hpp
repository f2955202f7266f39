/// TLS as a link uses it: version 1.3 only, both ends show a certificate of the lab's authority, and the certificate says
/// who its holder is. Everything of OpenSSL that touches a connection is behind these two classes.
///
/// Files are read once, at the start: what is wrong with them is told then and not when a peer connects.
#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <string>

#include "actors/link/revocation.hpp"
#include "actors/link/role.hpp"
#include "core/base/expected.hpp"

// Of OpenSSL; its headers stay in the sources.
struct ssl_ctx_st;
struct ssl_st;

namespace lichthof::actors {

/// Names of PEM files.
struct TlsFiles {
  std::string authority;    ///< the lab's certificate
  std::string certificate;  ///< our own, issued by it
  std::string key;          ///< our own, readable by nobody else
};

class TlsContext {
 public:
  /// What the authority has revoked stands beside its certificate, see revocation.hpp; that file alone is read again when it
  /// changes.
  /// @error bad_input with the file and the mend: missing, unreadable, damaged, not of this authority, expired, revoked, the
  ///        key of another certificate or readable by others
  static Expected<std::shared_ptr<const TlsContext>> load(const TlsFiles& files);

  TlsContext(std::shared_ptr<ssl_ctx_st> context, Identity own, std::shared_ptr<Revocations> revocations)
      : context_(std::move(context)), own_(std::move(own)), revocations_(std::move(revocations)) {}
  const Identity& own() const { return own_; }
  ssl_ctx_st* context() const { return context_.get(); }
  Revocations& revocations() const { return *revocations_; }

 private:
  std::shared_ptr<ssl_ctx_st> context_;
  Identity own_;
  std::shared_ptr<Revocations> revocations_;
};

/// TLS on one connected socket that never blocks.
class TlsSession {
 public:
  enum class Progress { done, again, failed };

  TlsSession(std::shared_ptr<const TlsContext> context, int socket, bool dialled);

  /// One step of the handshake; done: both ends have shown who they are.
  Progress shake_hands();
  Progress read(void* to, std::size_t most, std::size_t& count);
  Progress write(const void* from, std::size_t most, std::size_t& count);

  bool secured() const { return peer_.has_value(); }
  /// Bytes have been decrypted that nobody has read.
  bool unread() const;
  /// The last step stopped because the socket took nothing more.
  bool wants_to_write() const { return wants_to_write_; }
  /// What the peer's certificate says. @pre secured
  const Identity& peer() const { return *peer_; }
  /// Its certificate has been taken back meanwhile. @pre secured
  bool is_revoked() const { return context_->revocations().contain(peer_serial_); }
  /// Why it failed; empty when the peer just left.
  const std::string& failure() const { return failure_; }

 private:
  Progress outcome(int result);

  std::shared_ptr<const TlsContext> context_;
  std::shared_ptr<ssl_st> ssl_;
  std::optional<Identity> peer_;
  std::string peer_serial_;
  bool wants_to_write_ = false;
  std::string failure_;
};

}  // namespace lichthof::actors
