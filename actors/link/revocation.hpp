/// Certificates that the lab's authority has taken back: a list that it has signed (a CRL), in a file beside its certificate.
/// Whoever checks certificates looks at the file again whenever it has changed: no process needs to be restarted.
#pragma once

#include <cstdint>
#include <ctime>
#include <memory>
#include <mutex>
#include <set>
#include <string>

#include "core/base/expected.hpp"

// Of OpenSSL; its headers stay in the sources.
struct X509_crl_st;
struct x509_st;

namespace lichthof::actors {

/// Where the list of an authority lies: ca.crl beside ca.crt.
std::string revocation_file(const std::string& authority_file);
/// The number by which a certificate stands in the list, hexadecimal.
std::string serial_of(const x509_st* certificate);

/// A list as it was read. Null pointer: there is no file, nothing is revoked.
/// @error bad_input: no such list, or another than this authority has signed it
Expected<std::shared_ptr<X509_crl_st>> revocation_list(const std::string& path, x509_st* authority);
/// The numbers in it. @param list  may be null
std::set<std::string> serials_in(X509_crl_st* list);

/// Safe for any number of threads.
class Revocations {
 public:
  /// @error bad_input: as revocation_list()
  static Expected<std::shared_ptr<Revocations>> load(const std::string& authority_file,
                                                     std::shared_ptr<x509_st> authority);

  /// @cost a look at the file's date; reading it where that has changed
  bool contain(const std::string& serial);
  /// Grows whenever another list has been read: whoever was let in before may have to go.
  std::uint64_t generation();

 private:
  Revocations(std::string path, std::shared_ptr<x509_st> authority)
      : path_(std::move(path)), authority_(std::move(authority)) {}
  Status look();

  std::string path_;
  std::shared_ptr<x509_st> authority_;
  std::mutex mutex_;
  timespec changed_{};  ///< date of the file that was looked at last; zero: there was none
  std::uint64_t file_ = 0;
  std::set<std::string> serials_;
  std::uint64_t generation_ = 0;
};

}  // namespace lichthof::actors
