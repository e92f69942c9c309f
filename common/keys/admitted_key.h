// AdmittedKey: a public key that a service admits, and what its holder may do.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "common/keys/role.h"

namespace slabstream {

struct AdmittedKey {
  std::string public_key;  // common/transport/keys.h
  Role role = Role::kClient;
  std::string made;                             // UTC, such as "2026-11-21T10:00:00Z"
  std::string name = {};                        // its holder's name; empty: it was made for the file of its role
  std::optional<std::uint64_t> silent_ms = {};  // since its holder was last heard, as the coordinator tells; none: not since its start
  friend bool operator==(const AdmittedKey&, const AdmittedKey&) = default;
};

}  // namespace slabstream
