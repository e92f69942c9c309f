// KeyFolder: the keys of a service, in a folder that only their owner can open: keys.json holds the service's own pair and the public keys
// that it admits, and client.json, worker.json, admin.json and owner.json are what users of each role get (ServiceFile). Files are written
// whole or not at all. One process at a time writes; one thread at a time.
#pragma once

#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/status.h"
#include "common/keys/admitted_key.h"
#include "common/keys/role.h"
#include "common/service/service_file.h"
#include "common/transport/keys.h"

namespace slabstream {

inline constexpr std::size_t kMaxHolderNameBytes = 64;

// 1 to kMaxHolderNameBytes bytes of printable text that can stand in a file's name: no '/', no '.' at the beginning, no space at an end.
bool IsHolderName(std::string_view name);

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
  // Admits a key that its holder has made, so that its secret half stays there. `role`: client or admin. InvalidArgument: the role, a name
  // that is no IsHolderName or is another key's, or what is no key, or is admitted already.
  Result<AdmittedKey> Issue(const std::string& public_key, Role role, const std::string& name);
  // `key`: a public one, its IdOfKey, or its holder's name. The public key. NotFound: no such key; InvalidArgument: it means two keys.
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
