#include "actors/link/revocation.hpp"

#include <openssl/bn.h>
#include <openssl/err.h>
#include <openssl/pem.h>
#include <spdlog/spdlog.h>
#include <sys/stat.h>

#include "actors/link/certificate.hpp"

namespace lichthof::actors {

namespace {

std::string hexadecimal(const ASN1_INTEGER* number) {
  BIGNUM* value = ASN1_INTEGER_to_BN(number, nullptr);
  char* digits = value ? BN_bn2hex(value) : nullptr;
  const std::string text = digits ? digits : "";
  OPENSSL_free(digits);
  BN_free(value);
  return text;
}

}  // namespace

std::string revocation_file(const std::string& authority_file) {
  const std::string ending = ".crt";
  const bool has_ending = authority_file.ends_with(ending);
  return (has_ending ? authority_file.substr(0, authority_file.size() - ending.size()) : authority_file) + ".crl";
}

std::string serial_of(const x509_st* certificate) { return hexadecimal(X509_get0_serialNumber(certificate)); }

Expected<std::shared_ptr<X509_crl_st>> revocation_list(const std::string& path, x509_st* authority) {
  struct stat facts = {};
  if (::stat(path.c_str(), &facts) != 0 && errno == ENOENT) return std::shared_ptr<X509_crl_st>();
  const Expected<std::string> text = text_of(path);
  if (!text) return text.error();
  BIO* reader = BIO_new_mem_buf(text->data(), static_cast<int>(text->size()));
  std::shared_ptr<X509_crl_st> list(PEM_read_bio_X509_CRL(reader, nullptr, nullptr, nullptr), X509_CRL_free);
  BIO_free_all(reader);
  const bool is_ours = list && X509_CRL_verify(list.get(), X509_get0_pubkey(authority)) == 1;
  ERR_clear_error();
  if (!is_ours)
    return Error{ErrorCode::bad_input, path,
                 "no list of revoked certificates that the lab's authority has signed; copy it anew from where "
                 "`lichthof keys revoke` wrote it"};
  return list;
}

std::set<std::string> serials_in(X509_crl_st* list) {
  std::set<std::string> serials;
  STACK_OF(X509_REVOKED)* const entries = list ? X509_CRL_get_REVOKED(list) : nullptr;
  for (int i = 0; entries && i < sk_X509_REVOKED_num(entries); ++i)
    serials.insert(hexadecimal(X509_REVOKED_get0_serialNumber(sk_X509_REVOKED_value(entries, i))));
  return serials;
}

Expected<std::shared_ptr<Revocations>> Revocations::load(const std::string& authority_file,
                                                         std::shared_ptr<x509_st> authority) {
  std::shared_ptr<Revocations> made(new Revocations(revocation_file(authority_file), std::move(authority)));
  if (Status good = made->look(); !good) return good.error();
  return made;
}

/// Whatever is wrong with a new list, what is known stays revoked.
Status Revocations::look() {
  struct stat facts = {};
  const bool is_there = ::stat(path_.c_str(), &facts) == 0;
  const timespec changed = is_there ? facts.st_mtim : timespec{};
  const std::uint64_t file = is_there ? facts.st_ino : 0;
  if (changed.tv_sec == changed_.tv_sec && changed.tv_nsec == changed_.tv_nsec && file == file_) return Done{};
  changed_ = changed, file_ = file;
  if (!is_there)
    return Error{ErrorCode::bad_input, path_, "the list of revoked certificates is gone; what it said holds"};
  const Expected<std::shared_ptr<X509_crl_st>> list = revocation_list(path_, authority_.get());
  if (!list) return list.error();
  serials_ = serials_in(list->get());
  ++generation_;
  return Done{};
}

bool Revocations::contain(const std::string& serial) {
  const std::lock_guard lock(mutex_);
  if (Status good = look(); !good) spdlog::error("{}", good.error().text());
  return serials_.contains(serial);
}

std::uint64_t Revocations::generation() {
  const std::lock_guard lock(mutex_);
  if (Status good = look(); !good) spdlog::error("{}", good.error().text());
  return generation_;
}

}  // namespace lichthof::actors
