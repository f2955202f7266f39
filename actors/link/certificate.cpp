#include "actors/link/certificate.hpp"

#include <openssl/err.h>
#include <openssl/pem.h>
#include <sys/stat.h>

#include <cerrno>
#include <cstdio>
#include <cstring>

namespace lichthof::actors {

namespace {

constexpr std::size_t max_file_bytes = 1u << 20;

using BioPointer = std::unique_ptr<BIO, Release<BIO, BIO_free_all>>;

Error refused(const std::string& where, std::string what) { return {ErrorCode::bad_input, where, std::move(what)}; }

BioPointer reader_of(const std::string& text) {
  return BioPointer(BIO_new_mem_buf(text.data(), static_cast<int>(text.size())));
}

/// Keys of ours have no passphrase, and nobody is there to be asked for one.
int no_passphrase(char*, int, int, void*) { return -1; }

}  // namespace

std::string field_of(const X509_NAME* name, int nid) {
  const int at = X509_NAME_get_index_by_NID(name, nid, -1);
  if (at < 0 || X509_NAME_get_index_by_NID(name, nid, at) >= 0) return {};
  const ASN1_STRING* value = X509_NAME_ENTRY_get_data(X509_NAME_get_entry(name, at));
  unsigned char* utf8 = nullptr;
  const int length = ASN1_STRING_to_UTF8(&utf8, value);
  if (length < 0) return {};
  std::string text(reinterpret_cast<char*>(utf8), static_cast<std::size_t>(length));
  OPENSSL_free(utf8);
  return text;
}

Expected<Identity> identity_of(const X509* certificate) {
  const X509_NAME* subject = X509_get_subject_name(certificate);
  const std::string name = field_of(subject, NID_commonName), role = field_of(subject, NID_organizationalUnitName);
  const auto known = role_named(role);
  if (!is_name(name) || !known)
    return refused("", "the certificate names no role of lichthof; issue one with `lichthof keys issue`");
  return Identity{name, *known};
}

Expected<std::string> text_of(const std::string& path) {
  std::FILE* file = std::fopen(path.c_str(), "rbe");
  if (!file) return refused(path, std::strerror(errno));
  std::string text(max_file_bytes + 1, '\0');
  text.resize(std::fread(text.data(), 1, text.size(), file));
  const int problem = std::ferror(file) ? errno : 0;
  std::fclose(file);
  if (problem != 0) return refused(path, std::strerror(problem));
  if (text.size() > max_file_bytes) return refused(path, "too long for a certificate or key");
  return text;
}

Expected<X509Pointer> certificate_in(const std::string& path) {
  const Expected<std::string> text = text_of(path);
  if (!text) return text.error();
  const BioPointer reader = reader_of(*text);
  X509Pointer certificate(PEM_read_bio_X509(reader.get(), nullptr, no_passphrase, nullptr));
  if (!certificate) return ERR_clear_error(), refused(path, "no certificate in PEM form");
  return certificate;
}

Expected<KeyPointer> key_in(const std::string& path) {
  struct stat facts = {};
  if (::stat(path.c_str(), &facts) != 0) return refused(path, std::strerror(errno));
  if ((facts.st_mode & (S_IRWXG | S_IRWXO)) != 0)
    return refused(path, "others than its owner can use this key; run: chmod 600 " + path);
  const Expected<std::string> text = text_of(path);
  if (!text) return text.error();
  const BioPointer reader = reader_of(*text);
  KeyPointer key(PEM_read_bio_PrivateKey(reader.get(), nullptr, no_passphrase, nullptr));
  if (!key) return ERR_clear_error(), refused(path, "no private key in PEM form without passphrase");
  return key;
}

std::string openssl_problem() {
  const unsigned long code = ERR_peek_last_error();
  const char* words = code != 0 ? ERR_reason_error_string(code) : nullptr;
  ERR_clear_error();
  return words ? words : "OpenSSL gives no reason";
}

}  // namespace lichthof::actors
