// AdmittedKey: a public key that a service admits, and what its holder may do.
#pragma once

#include <string>

#include "common/keys/role.h"

namespace slabstream {

struct AdmittedKey {
  std::string public_key;  // common/transport/keys.h
  Role role = Role::kClient;
  std::string made;  // UTC, such as "2026-11-21T10:00:00Z"
  friend bool operator==(const AdmittedKey&, const AdmittedKey&) = default;
};

}  // namespace slabstream
