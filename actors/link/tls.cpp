#include "actors/link/tls.hpp"

#include <openssl/bio.h>
#include <openssl/err.h>
#include <openssl/ssl.h>
#include <sys/socket.h>

#include <cerrno>

#include "actors/link/certificate.hpp"

namespace lichthof::actors {

namespace {

Error refused(const std::string& where, std::string what) { return {ErrorCode::bad_input, where, std::move(what)}; }

// ---- The socket below -------------------------------------------------------------------------------------------------
// OpenSSL's own way to a socket raises SIGPIPE when the peer has gone: this one asks the kernel not to.

int socket_of(BIO* bio) { return static_cast<int>(reinterpret_cast<std::intptr_t>(BIO_get_data(bio))); }

int moved(BIO* bio, ssize_t count, void (*retry)(BIO*)) {
  BIO_clear_retry_flags(bio);
  if (count < 0 && (errno == EAGAIN || errno == EWOULDBLOCK || errno == EINTR)) retry(bio);
  return static_cast<int>(count);
}

int socket_write(BIO* bio, const char* from, int count) {
  return moved(bio, ::send(socket_of(bio), from, static_cast<std::size_t>(count), MSG_NOSIGNAL),
               [](BIO* b) { BIO_set_retry_write(b); });
}

int socket_read(BIO* bio, char* to, int count) {
  return moved(bio, ::recv(socket_of(bio), to, static_cast<std::size_t>(count), 0),
               [](BIO* b) { BIO_set_retry_read(b); });
}

long socket_control(BIO*, int command, long, void*) { return command == BIO_CTRL_FLUSH ? 1 : 0; }

BIO* bio_on(int socket) {
  static BIO_METHOD* const method = [] {
    BIO_METHOD* made = BIO_meth_new(BIO_get_new_index() | BIO_TYPE_SOURCE_SINK, "socket without signals");
    BIO_meth_set_write(made, socket_write);
    BIO_meth_set_read(made, socket_read);
    BIO_meth_set_ctrl(made, socket_control);
    return made;
  }();
  BIO* bio = BIO_new(method);
  BIO_set_data(bio, reinterpret_cast<void*>(static_cast<std::intptr_t>(socket)));
  BIO_set_init(bio, 1);
  return bio;
}

// ---- Files ------------------------------------------------------------------------------------------------------------

/// @returns empty, or why this certificate would be refused by peers of the same authority
std::string weakness(X509* certificate, X509* authority) {
  X509_STORE* store = X509_STORE_new();
  X509_STORE_add_cert(store, authority);
  X509_STORE_CTX* check = X509_STORE_CTX_new();
  X509_STORE_CTX_init(check, store, certificate, nullptr);
  const bool good = X509_verify_cert(check) == 1;
  const std::string why = good ? "" : X509_verify_cert_error_string(X509_STORE_CTX_get_error(check));
  X509_STORE_CTX_free(check);
  X509_STORE_free(store);
  return why;
}

/// Asked by OpenSSL for each certificate of a chain, at depth 0 for the peer's own.
int not_revoked(int is_good, X509_STORE_CTX* check) {
  if (is_good != 1 || X509_STORE_CTX_get_error_depth(check) > 0) return is_good;
  const auto* ssl = static_cast<const SSL*>(X509_STORE_CTX_get_ex_data(check, SSL_get_ex_data_X509_STORE_CTX_idx()));
  auto* const revocations = static_cast<Revocations*>(SSL_CTX_get_app_data(SSL_get_SSL_CTX(ssl)));
  if (!revocations->contain(serial_of(X509_STORE_CTX_get_current_cert(check)))) return 1;
  X509_STORE_CTX_set_error(check, X509_V_ERR_CERT_REVOKED);
  return 0;
}

}  // namespace

Expected<std::shared_ptr<const TlsContext>> TlsContext::load(const TlsFiles& files) {
  ERR_clear_error();
  Expected<X509Pointer> authority = certificate_in(files.authority);
  if (!authority) return authority.error();
  const Expected<X509Pointer> certificate = certificate_in(files.certificate);
  if (!certificate) return certificate.error();
  const Expected<KeyPointer> key = key_in(files.key);
  if (!key) return key.error();
  if (X509_check_private_key(certificate->get(), key->get()) != 1) {
    ERR_clear_error();
    return refused(files.key, "not the key of " + files.certificate);
  }
  if (const std::string why = weakness(certificate->get(), authority->get()); !why.empty())
    return refused(files.certificate,
                   "not valid under " + files.authority + ": " + why + "; issue one with `lichthof keys issue`");
  Expected<Identity> own = identity_of(certificate->get());
  if (!own) return refused(files.certificate, own.error().message);

  X509_up_ref(authority->get());
  Expected<std::shared_ptr<Revocations>> revocations =
      Revocations::load(files.authority, std::shared_ptr<X509>(authority->get(), X509_free));
  if (!revocations) return revocations.error();
  if ((*revocations)->contain(serial_of(certificate->get())))
    return refused(files.certificate, "has been revoked; issue another with `lichthof keys issue`");

  std::shared_ptr<SSL_CTX> context(SSL_CTX_new(TLS_method()), SSL_CTX_free);
  SSL_CTX_set_app_data(context.get(), revocations->get());
  X509_STORE_add_cert(SSL_CTX_get_cert_store(context.get()), authority->get());
  SSL_CTX_set_min_proto_version(context.get(), TLS1_3_VERSION);
  // Sessions are long: nothing is gained by resuming one, and no ticket is left to be written to a peer that has gone.
  SSL_CTX_set_session_cache_mode(context.get(), SSL_SESS_CACHE_OFF);
  SSL_CTX_set_num_tickets(context.get(), 0);
  SSL_CTX_set_mode(context.get(), SSL_MODE_ENABLE_PARTIAL_WRITE | SSL_MODE_ACCEPT_MOVING_WRITE_BUFFER);
  SSL_CTX_set_verify(context.get(), SSL_VERIFY_PEER | SSL_VERIFY_FAIL_IF_NO_PEER_CERT, not_revoked);
  SSL_CTX_set_max_cert_list(context.get(), 16384);
  if (SSL_CTX_use_certificate(context.get(), certificate->get()) != 1 ||
      SSL_CTX_use_PrivateKey(context.get(), key->get()) != 1)
    return refused(files.certificate, openssl_problem());
  return std::shared_ptr<const TlsContext>(
      std::make_shared<TlsContext>(std::move(context), std::move(*own), std::move(*revocations)));
}

TlsSession::TlsSession(std::shared_ptr<const TlsContext> context, int socket, bool dialled)
    : context_(std::move(context)), ssl_(SSL_new(context_->context()), SSL_free) {
  BIO* bio = bio_on(socket);
  SSL_set_bio(ssl_.get(), bio, bio);
  if (dialled)
    SSL_set_connect_state(ssl_.get());
  else
    SSL_set_accept_state(ssl_.get());
}

TlsSession::Progress TlsSession::outcome(int result) {
  const int kind = SSL_get_error(ssl_.get(), result);
  wants_to_write_ = kind == SSL_ERROR_WANT_WRITE;
  if (kind == SSL_ERROR_WANT_READ || kind == SSL_ERROR_WANT_WRITE) return Progress::again;
  if (kind != SSL_ERROR_SSL) {
    ERR_clear_error();
    return Progress::failed;
  }
  const long verdict = SSL_get_verify_result(ssl_.get());
  const int reason = ERR_GET_REASON(ERR_peek_last_error());
  if (reason == SSL_R_UNEXPECTED_EOF_WHILE_READING)
    ERR_clear_error();
  else if (verdict != X509_V_OK)
    failure_ = std::string("the peer's certificate is refused: ") + X509_verify_cert_error_string(verdict);
  else if (reason == SSL_R_WRONG_VERSION_NUMBER || reason == SSL_R_HTTP_REQUEST || reason == SSL_R_BAD_RECORD_TYPE ||
           reason == SSL_R_PACKET_LENGTH_TOO_LONG)
    failure_ = "the peer does not speak TLS";
  else if (reason >= SSL_AD_REASON_OFFSET)
    failure_ = "the peer refuses our certificate: " + openssl_problem();
  else
    failure_ = "TLS: " + openssl_problem();
  ERR_clear_error();
  return Progress::failed;
}

TlsSession::Progress TlsSession::shake_hands() {
  ERR_clear_error();
  const int result = SSL_do_handshake(ssl_.get());
  if (result != 1) return outcome(result);
  wants_to_write_ = false;
  const X509Pointer certificate(SSL_get1_peer_certificate(ssl_.get()));
  Expected<Identity> peer =
      certificate ? identity_of(certificate.get()) : Expected<Identity>(refused("", "the peer shows no certificate"));
  if (!peer) {
    failure_ = peer.error().message;
    return Progress::failed;
  }
  peer_ = std::move(*peer);
  peer_serial_ = serial_of(certificate.get());
  return Progress::done;
}

TlsSession::Progress TlsSession::read(void* to, std::size_t most, std::size_t& count) {
  ERR_clear_error();
  const int result = SSL_read_ex(ssl_.get(), to, most, &count);
  wants_to_write_ = false;
  if (result == 1) return Progress::done;
  count = 0;
  return outcome(result);
}

bool TlsSession::unread() const { return SSL_pending(ssl_.get()) > 0; }

TlsSession::Progress TlsSession::write(const void* from, std::size_t most, std::size_t& count) {
  ERR_clear_error();
  const int result = SSL_write_ex(ssl_.get(), from, most, &count);
  wants_to_write_ = false;
  if (result == 1) return Progress::done;
  count = 0;
  return outcome(result);
}

}  // namespace lichthof::actors
