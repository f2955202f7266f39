#include "actors/link/keys.hpp"

#include <fcntl.h>
#include <openssl/asn1.h>
#include <openssl/bio.h>
#include <openssl/bn.h>
#include <openssl/ec.h>
#include <openssl/err.h>
#include <openssl/pem.h>
#include <openssl/rand.h>
#include <openssl/x509v3.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <ctime>
#include <filesystem>
#include <system_error>

#include "actors/link/certificate.hpp"
#include "actors/link/revocation.hpp"

namespace lichthof::actors {

namespace {

constexpr const char* authority_name = "Lichthof authority";
constexpr const char* authority_role = "authority";
constexpr const char* authority_file = "ca";

Error refused(const std::string& where, std::string what) { return {ErrorCode::bad_input, where, std::move(what)}; }
Error io_failure(const std::string& where) { return {ErrorCode::io, where, std::strerror(errno)}; }

using BioPointer = std::unique_ptr<BIO, Release<BIO, BIO_free_all>>;

std::string text_in(BIO* bio) {
  char* data = nullptr;
  const long length = BIO_get_mem_data(bio, &data);
  return std::string(data, static_cast<std::size_t>(std::max(0L, length)));
}

// ---- Files ------------------------------------------------------------------------------------------------------------

/// All of it or none, under a temporary name.
Status write_beside(const std::string& path, const std::string& temporary, const std::string& text, mode_t mode) {
  ::unlink(temporary.c_str());  // left over from an interrupted run
  const int fd = ::open(temporary.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, mode);
  if (fd < 0) return io_failure(path);
  bool good = ::fchmod(fd, mode) == 0;
  for (std::size_t at = 0; good && at < text.size();) {
    const ssize_t count = ::write(fd, text.data() + at, text.size() - at);
    if (count > 0) at += static_cast<std::size_t>(count);
    good = count > 0 || errno == EINTR;
  }
  good = good && ::fsync(fd) == 0;
  const int problem = errno;
  good = ::close(fd) == 0 && good;
  if (good) return Done{};
  ::unlink(temporary.c_str());
  errno = problem;
  return io_failure(path);
}

/// A new file, never over another one.
Status write_new(const std::string& path, const std::string& text, mode_t mode) {
  const std::string temporary = path + ".new";
  if (Status written = write_beside(path, temporary, text, mode); !written) return written;
  // A link fails where a rename would replace.
  const bool good = ::link(temporary.c_str(), path.c_str()) == 0;
  const int problem = errno;
  ::unlink(temporary.c_str());
  if (good) return Done{};
  if (problem == EEXIST) return refused(path, "exists already and is not overwritten");
  errno = problem;
  return io_failure(path);
}

/// In the place of what was there.
Status write_over(const std::string& path, const std::string& text, mode_t mode) {
  const std::string temporary = path + ".new";
  if (Status written = write_beside(path, temporary, text, mode); !written) return written;
  if (::rename(temporary.c_str(), path.c_str()) != 0) return io_failure(path);
  return Done{};
}

Status nothing_there(const std::string& path) {
  struct stat facts = {};
  if (::lstat(path.c_str(), &facts) == 0) return refused(path, "exists already and is not overwritten");
  return Done{};
}

/// Both files, or none.
Status write_pair(const std::string& stem, X509* certificate, EVP_PKEY* key) {
  const std::string certificate_path = stem + ".crt", key_path = stem + ".key";
  for (const std::string& path : {certificate_path, key_path})
    if (Status free = nothing_there(path); !free) return free;
  const BioPointer key_text(BIO_new(BIO_s_mem())), certificate_text(BIO_new(BIO_s_mem()));
  if (PEM_write_bio_PKCS8PrivateKey(key_text.get(), key, nullptr, nullptr, 0, nullptr, nullptr) != 1 ||
      PEM_write_bio_X509(certificate_text.get(), certificate) != 1)
    return Error{ErrorCode::failed, certificate_path, openssl_problem()};
  if (Status written = write_new(key_path, text_in(key_text.get()), 0600); !written) return written;
  Status written = write_new(certificate_path, text_in(certificate_text.get()), 0644);
  if (!written) ::unlink(key_path.c_str());
  return written;
}

// ---- Certificates -----------------------------------------------------------------------------------------------------

bool add_extension(X509* certificate, X509* issuer, int nid, const char* value) {
  X509V3_CTX context = {};
  X509V3_set_ctx_nodb(&context);
  X509V3_set_ctx(&context, issuer, certificate, nullptr, nullptr, 0);
  X509_EXTENSION* extension = X509V3_EXT_conf_nid(nullptr, &context, nid, value);
  const bool good = extension && X509_add_ext(certificate, extension, -1) == 1;
  X509_EXTENSION_free(extension);
  return good;
}

bool add_field(X509_NAME* name, int nid, const std::string& value) {
  return X509_NAME_add_entry_by_NID(name, nid, MBSTRING_UTF8, reinterpret_cast<const unsigned char*>(value.data()),
                                    static_cast<int>(value.size()), -1, 0) == 1;
}

bool set_number(X509* certificate) {
  unsigned char random[16];
  if (RAND_bytes(random, sizeof random) != 1) return false;
  random[0] &= 0x7f;  // positive
  BIGNUM* number = BN_bin2bn(random, sizeof random, nullptr);
  const bool good = number && BN_to_ASN1_INTEGER(number, X509_get_serialNumber(certificate));
  BN_free(number);
  return good;
}

struct Issuer {
  X509* certificate;  ///< null: by itself
  EVP_PKEY* key;
};

/// @returns null when OpenSSL fails
X509Pointer signed_certificate(EVP_PKEY* key, const std::string& name, const std::string& role,
                               const Validity& validity, const Issuer& issuer) {
  X509Pointer made(X509_new());
  X509* certificate = made.get();
  X509* by = issuer.certificate ? issuer.certificate : certificate;
  const bool is_authority = !issuer.certificate;
  const bool good = certificate && X509_set_version(certificate, X509_VERSION_3) == 1 && set_number(certificate) &&
                    X509_gmtime_adj(X509_getm_notBefore(certificate), validity.from_s) &&
                    X509_gmtime_adj(X509_getm_notAfter(certificate), validity.to_s) &&
                    X509_set_pubkey(certificate, key) == 1 &&
                    add_field(X509_get_subject_name(certificate), NID_commonName, name) &&
                    add_field(X509_get_subject_name(certificate), NID_organizationalUnitName, role) &&
                    X509_set_issuer_name(certificate, X509_get_subject_name(by)) == 1 &&
                    add_extension(certificate, by, NID_basic_constraints,
                                  is_authority ? "critical,CA:TRUE,pathlen:0" : "critical,CA:FALSE") &&
                    add_extension(certificate, by, NID_key_usage,
                                  is_authority ? "critical,keyCertSign,cRLSign" : "critical,digitalSignature") &&
                    (is_authority || add_extension(certificate, by, NID_ext_key_usage, "clientAuth,serverAuth")) &&
                    add_extension(certificate, by, NID_subject_key_identifier, "hash") &&
                    add_extension(certificate, by, NID_authority_key_identifier, "keyid:always") &&
                    X509_sign(certificate, issuer.key, EVP_sha256()) > 0;
  return good ? std::move(made) : nullptr;
}

Status issue(const std::string& stem, const std::string& name, const std::string& role, const Validity& validity,
             X509* authority, EVP_PKEY* authority_key) {
  const KeyPointer key(EVP_EC_gen("P-256"));
  if (!key) return Error{ErrorCode::failed, stem + ".key", openssl_problem()};
  const X509Pointer certificate =
      signed_certificate(key.get(), name, role, validity, {authority, authority ? authority_key : key.get()});
  if (!certificate) return Error{ErrorCode::failed, stem + ".crt", openssl_problem()};
  return write_pair(stem, certificate.get(), key.get());
}

struct AuthorityPair {
  X509Pointer certificate;
  KeyPointer key;
};
Expected<AuthorityPair> authority_in(const std::string& folder) {
  const std::string stem = folder + "/" + authority_file;
  Expected<X509Pointer> certificate = certificate_in(stem + ".crt");
  if (!certificate)
    return refused(certificate.error().where,
                   certificate.error().message + "; make one with: lichthof keys init " + folder);
  Expected<KeyPointer> key = key_in(stem + ".key");
  if (!key) return key.error();
  return AuthorityPair{std::move(*certificate), std::move(*key)};
}

// ---- The list of the revoked ------------------------------------------------------------------------------------------

using ListPointer = std::unique_ptr<X509_CRL, Release<X509_CRL, X509_CRL_free>>;
using TimePointer = std::unique_ptr<ASN1_TIME, Release<ASN1_TIME, ASN1_TIME_free>>;

/// The old list with one more. @param old  may be null @returns null when OpenSSL fails
ListPointer longer_list(X509_CRL* old, const X509* revoked, const AuthorityPair& authority) {
  ListPointer list(old ? X509_CRL_dup(old) : X509_CRL_new());
  // A list that ran out would shut everybody out: it is good as long as its authority.
  const TimePointer now(X509_gmtime_adj(nullptr, 0));
  X509_REVOKED* entry = X509_REVOKED_new();
  const bool is_filed =
      list && entry && X509_REVOKED_set_revocationDate(entry, now.get()) == 1 &&
      X509_REVOKED_set_serialNumber(entry, const_cast<ASN1_INTEGER*>(X509_get0_serialNumber(revoked))) == 1 &&
      X509_CRL_add0_revoked(list.get(), entry) == 1;
  if (!is_filed) {
    X509_REVOKED_free(entry);
    return nullptr;
  }
  const X509* issuer = authority.certificate.get();
  const bool good = X509_CRL_set_version(list.get(), X509_CRL_VERSION_2) == 1 &&
                    X509_CRL_set_issuer_name(list.get(), X509_get_subject_name(issuer)) == 1 &&
                    X509_CRL_set1_lastUpdate(list.get(), now.get()) == 1 &&
                    X509_CRL_set1_nextUpdate(list.get(), X509_get0_notAfter(issuer)) == 1 &&
                    X509_CRL_sort(list.get()) == 1 && X509_CRL_sign(list.get(), authority.key.get(), EVP_sha256()) > 0;
  return good ? std::move(list) : nullptr;
}

/// Whether a certificate stands in the list beside its authority's; what is wrong with the list is told elsewhere.
bool is_revoked(const std::string& folder, const X509* certificate) {
  const std::string authority_path = folder + "/" + authority_file + ".crt";
  const Expected<X509Pointer> authority = certificate_in(authority_path);
  if (!authority) return false;
  const auto list = revocation_list(revocation_file(authority_path), authority->get());
  return list && serials_in(list->get()).contains(serial_of(certificate));
}

std::string utc(const ASN1_TIME* time) {
  std::tm parts = {};
  char text[32] = "?";
  if (ASN1_TIME_to_tm(time, &parts) == 1) std::strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%SZ", &parts);
  return text;
}

std::string fingerprint_of(const X509* certificate) {
  unsigned char digest[EVP_MAX_MD_SIZE];
  unsigned int length = 0;
  if (X509_digest(certificate, EVP_sha256(), digest, &length) != 1) return {};
  std::string text;
  char pair[3];
  for (unsigned int i = 0; i < length; ++i) {
    std::snprintf(pair, sizeof pair, "%02x", digest[i]);
    text += pair;
  }
  return text;
}

Expected<CertificateFacts> facts_of(const std::string& path) {
  const Expected<X509Pointer> read = certificate_in(path);
  if (!read) return read.error();
  const X509* certificate = read->get();
  CertificateFacts facts;
  facts.file = path;
  facts.name = field_of(X509_get_subject_name(certificate), NID_commonName);
  facts.role = field_of(X509_get_subject_name(certificate), NID_organizationalUnitName);
  facts.issuer = field_of(X509_get_issuer_name(certificate), NID_commonName);
  facts.valid_from = utc(X509_get0_notBefore(certificate));
  facts.valid_to = utc(X509_get0_notAfter(certificate));
  facts.fingerprint = fingerprint_of(certificate);
  if (X509_cmp_current_time(X509_get0_notBefore(certificate)) > 0) facts.problem = "not valid yet";
  if (X509_cmp_current_time(X509_get0_notAfter(certificate)) < 0) facts.problem = "expired";
  const std::size_t slash = path.rfind('/');
  if (is_revoked(slash == std::string::npos ? "." : path.substr(0, slash), certificate)) facts.problem = "revoked";
  return facts;
}

}  // namespace

Status create_authority(const std::string& folder, const Validity& validity) {
  if (::mkdir(folder.c_str(), 0700) != 0 && errno != EEXIST) return io_failure(folder);
  return issue(folder + "/" + authority_file, authority_name, authority_role, validity, nullptr, nullptr);
}

Status issue_certificate(const std::string& folder, const Identity& who, const Validity& validity) {
  if (!is_name(who.name) || who.name == authority_file)
    return refused(who.name, "a name has 1 to 64 letters, digits and ._-, begins with no dot or dash, and is not ca");
  const Expected<AuthorityPair> authority = authority_in(folder);
  if (!authority) return authority.error();
  const std::string stem = folder + "/" + who.name;
  // What has been revoked makes room for its successor.
  if (const Expected<X509Pointer> former = certificate_in(stem + ".crt"); former && is_revoked(folder, former->get()))
    for (const char* ending : {".crt", ".key"}) ::unlink((stem + ending).c_str());
  return issue(stem, who.name, name_of(who.role), validity, authority->certificate.get(), authority->key.get());
}

Status revoke_certificate(const std::string& folder, const std::string& name) {
  if (!is_name(name) || name == authority_file) return refused(name, "is no name of a certificate of the lab");
  const Expected<AuthorityPair> authority = authority_in(folder);
  if (!authority) return authority.error();
  X509* const issuer = authority->certificate.get();
  const std::string path = folder + "/" + name + ".crt",
                    list_path = revocation_file(folder + "/" + authority_file + ".crt");
  const Expected<X509Pointer> certificate = certificate_in(path);
  if (!certificate) return certificate.error();
  if (X509_verify(certificate->get(), X509_get0_pubkey(issuer)) != 1)
    return ERR_clear_error(), refused(path, "is no certificate of the authority in " + folder);
  const Expected<std::shared_ptr<X509_CRL>> old = revocation_list(list_path, issuer);
  if (!old) return old.error();
  if (serials_in(old->get()).contains(serial_of(certificate->get()))) return refused(path, "is revoked already");
  const ListPointer list = longer_list(old->get(), certificate->get(), *authority);
  const BioPointer text(BIO_new(BIO_s_mem()));
  if (!list || PEM_write_bio_X509_CRL(text.get(), list.get()) != 1)
    return Error{ErrorCode::failed, list_path, openssl_problem()};
  return write_over(list_path, text_in(text.get()), 0644);
}

Expected<std::vector<CertificateFacts>> certificate_facts(const std::string& path) {
  std::vector<std::string> files{path};
  std::error_code problem;
  if (std::filesystem::is_directory(path, problem)) {
    files.clear();
    for (const auto& entry : std::filesystem::directory_iterator(path, problem))
      if (entry.path().extension() == ".crt") files.push_back(entry.path().string());
    if (problem) return Error{ErrorCode::io, path, problem.message()};
    if (files.empty()) return refused(path, "no .crt in this folder");
    std::sort(files.begin(), files.end());
  }
  std::vector<CertificateFacts> all;
  for (const std::string& file : files) {
    Expected<CertificateFacts> facts = facts_of(file);
    if (!facts) return facts.error();
    all.push_back(std::move(*facts));
  }
  return all;
}

}  // namespace lichthof::actors
