// KeyFolder: the keys of a service, in a folder that only their owner can open: keys.json holds the service's own pair and the public keys
// that it admits, and client.json, worker.json and admin.json are what users of each role get (ServiceFile). Files are written whole or not
// at all. One process at a time writes; one thread at a time.
#pragma once

#include <set>
#include <string>
#include <vector>

#include "common/base/status.h"
#include "common/keys/admitted_key.h"
#include "common/keys/role.h"
#include "common/service/service_file.h"
#include "common/transport/keys.h"

namespace slabstream {

class KeyFolder {
 public:
  // Makes the folder (0700) and a pair for the service if there are none. Unavailable: it cannot be made, or others can open it.
  // InvalidArgument: keys.json is damaged.
  static Result<KeyFolder> Open(const std::string& path);

  const KeyPair& server() const { return server_; }
  const std::vector<AdmittedKey>& admitted() const { return admitted_; }
  std::set<std::string> KeysOf(const std::set<Role>& roles) const;
  const AdmittedKey* Find(const std::string& public_key) const;  // null: it is not admitted

  struct Service {
    std::string client_endpoint, worker_endpoint;
    std::uint64_t epoch = 0;
  };
  // Writes the file of each role, with the key that it holds if that is admitted, else with a new one.
  Status Publish(const Service& service);

  // A new pair for the role's file. The keys of the role until now stay admitted until they are revoked.
  Result<AdmittedKey> Rotate(Role role);
  // `key`: a public one, or its IdOfKey. The public key. NotFound: no such key; InvalidArgument: two keys have this id.
  Result<std::string> Revoke(const std::string& key);

 private:
  explicit KeyFolder(std::string path) : path_(std::move(path)) {}
  std::string FileOf(Role role) const;
  Status Read();
  Status Save() const;
  Status WriteFile(Role role, const KeyPair& own, const std::string& made) const;

  std::string path_;
  KeyPair server_;
  std::vector<AdmittedKey> admitted_;
  Service service_;
};

}  // namespace slabstream
