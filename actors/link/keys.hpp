/// The lab's keys: an authority, and certificates that it issues to the processes and people of one cluster. Whoever holds a
/// certificate of the authority is let in, in the role that stands in it; so the folder with `ca.key` is the lab's most
/// precious file.
///
///     FOLDER/ca.crt  ca.key           the authority; ca.crt is copied to every machine
///     FOLDER/ca.crl                   what it has taken back; lies beside ca.crt on every machine that asks others for theirs
///     FOLDER/NAME.crt  NAME.key       goes to the machine of that name
///
/// Files appear whole, keys with mode 0600, and nothing is ever overwritten but the list, and a pair that has been revoked.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "actors/link/role.hpp"
#include "core/base/expected.hpp"

namespace lichthof::actors {

/// From when until when, in seconds from now. The default begins a little ago: clocks differ.
struct Validity {
  std::int64_t from_s = -3600;
  std::int64_t to_s = 0;
};
inline constexpr std::int64_t day_s = 86400;
inline constexpr Validity authority_validity{-3600, 3653 * day_s};
inline constexpr Validity issued_validity{-3600, 730 * day_s};

/// Elliptic curve P-256. Makes the folder when it is missing.
/// @error bad_input: there is an authority already; io: what can not be written
Status create_authority(const std::string& folder, const Validity& validity = authority_validity);

/// @error bad_input: no authority in the folder, no good name, the name is taken; io: what can not be written
Status issue_certificate(const std::string& folder, const Identity& who, const Validity& validity = issued_validity);

/// Adds the certificate of that name to the list of those that count no more.
/// @error bad_input: no authority in the folder, no such certificate, revoked already; io: what can not be written
Status revoke_certificate(const std::string& folder, const std::string& name);

/// What stands in a certificate.
struct CertificateFacts {
  std::string file;
  std::string name, role;  ///< the authority's role is "authority"
  std::string issuer;
  std::string valid_from, valid_to;  ///< UTC: 2026-01-31T12:00:00Z
  std::string fingerprint;           ///< SHA-256, hexadecimal
  std::string problem;               ///< revoked, expired, not valid yet; empty: none
};

/// Of one file, or of every .crt in a folder, by file name.
/// @error bad_input: nothing there, or no certificate
Expected<std::vector<CertificateFacts>> certificate_facts(const std::string& path);

}  // namespace lichthof::actors
