#include "actors/link/keys.hpp"

#include <fcntl.h>
#include <openssl/asn1.h>
#include <openssl/bio.h>
#include <openssl/bn.h>
#include <openssl/ec.h>
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

/// Writes a new file: all of it or none, and never over another one.
Status write_new(const std::string& path, const std::string& text, mode_t mode) {
  const std::string temporary = path + ".new";
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
  good = ::close(fd) == 0 && good;
  // A link fails where a rename would replace.
  good = good && ::link(temporary.c_str(), path.c_str()) == 0;
  const int problem = errno;
  ::unlink(temporary.c_str());
  if (good) return Done{};
  if (problem == EEXIST) return refused(path, "exists already and is not overwritten");
  errno = problem;
  return io_failure(path);
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
                                  is_authority ? "critical,keyCertSign" : "critical,digitalSignature") &&
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
  const std::string authority_stem = folder + "/" + authority_file;
  const Expected<X509Pointer> authority = certificate_in(authority_stem + ".crt");
  if (!authority)
    return refused(authority.error().where,
                   authority.error().message + "; make one with: lichthof keys init " + folder);
  const Expected<KeyPointer> key = key_in(authority_stem + ".key");
  if (!key) return key.error();
  return issue(folder + "/" + who.name, who.name, name_of(who.role), validity, authority->get(), key->get());
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
