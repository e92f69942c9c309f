// Service files: all that somebody needs to reach a service with keys, as one JSON file for each role. Whoever can read the file has the
// role, so it is readable by its owner alone.
#pragma once

#include <cstdint>
#include <string>

#include "common/base/status.h"
#include "common/keys/role.h"
#include "common/transport/keys.h"

namespace slabstream {

struct ServiceFile {
  Role role = Role::kClient;
  std::string endpoint;     // the endpoint of the plane that the role uses: the workers' for workers and owners, else the clients'
  std::string server_key;   // the coordinator's public key
  KeyPair own;              // the role's own keys
  std::uint64_t epoch = 0;  // the epoch of the coordinator that wrote the file last
  std::uint32_t wire_version = 0;
  std::string made;  // UTC, such as "2026-11-21T10:00:00Z"

  ClientKeys keys() const { return {server_key, own}; }
  friend bool operator==(const ServiceFile&, const ServiceFile&) = default;
};

// Written whole or not at all, mode 0600. Unavailable: it cannot be written.
Status WriteServiceFile(const std::string& path, const ServiceFile& file);

// NotFound: no such file. InvalidArgument names the path and the field that is wrong, or says that others can read the file. Messages
// contain no secret.
Result<ServiceFile> ReadServiceFile(const std::string& path);

}  // namespace slabstream
