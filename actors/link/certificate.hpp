/// How identities stand in certificates: common name = name, organisational unit = role. For the sources of this folder that
/// speak to OpenSSL.
#pragma once

#include <openssl/evp.h>
#include <openssl/x509.h>

#include <memory>
#include <string>

#include "actors/link/role.hpp"
#include "core/base/expected.hpp"

namespace lichthof::actors {

template <class T, void (*release)(T*)>
struct Release {
  void operator()(T* pointer) const { release(pointer); }
};
using X509Pointer = std::unique_ptr<X509, Release<X509, X509_free>>;
using KeyPointer = std::unique_ptr<EVP_PKEY, Release<EVP_PKEY, EVP_PKEY_free>>;

/// One field of a subject or issuer (NID_commonName, ...); empty when it is not there exactly once.
std::string field_of(const X509_NAME* name, int nid);
/// @error bad_input: no name or role that lichthof knows
Expected<Identity> identity_of(const X509* certificate);

/// Whole text files. @error bad_input: missing, unreadable
Expected<std::string> text_of(const std::string& path);
Expected<X509Pointer> certificate_in(const std::string& path);
/// @error bad_input: also when others than the owner may read it
Expected<KeyPointer> key_in(const std::string& path);

/// Why OpenSSL said no, in its own words; forgets it.
std::string openssl_problem();

}  // namespace lichthof::actors
