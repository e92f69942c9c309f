// ServiceKeys: the keys of a running coordinator. It tells the authenticator whom each plane admits, knows what the sender of a message may
// do, and carries out orders about keys. For one thread.
#pragma once

#include <optional>
#include <string>
#include <unordered_map>
#include <vector>

#include "common/base/time.h"
#include "common/service/key_folder.h"
#include "common/transport/socket.h"
#include "common/wire/any_message.h"

namespace slabstream {

class ServiceKeys {
 public:
  // Errors of KeyFolder::Open.
  static Result<ServiceKeys> Open(Context& context, const std::string& folder, Epoch epoch);

  ServerKeys For(Plane plane) const;

  // Once the planes are bound: writes the service files, with new keys where they are missing. Errors of KeyFolder::Publish.
  Status Publish(const std::string& client_endpoint, const std::string& worker_endpoint);

  // The role of whoever sent a message over an encrypted connection, which also notes that it was heard; nullopt: its
  // key is no longer admitted.
  std::optional<Role> RoleOf(const Incoming& incoming);

  struct Done {
    CoordinatorToClient answer;          // KeysReply or OrderRefused
    std::optional<std::string> revoked;  // a public key whose connections must end
  };
  Done CarryOut(const KeysOrder& order);

 private:
  ServiceKeys(Context& context, KeyFolder folder, Epoch epoch) : context_(&context), folder_(std::move(folder)), epoch_(epoch) {}
  std::string NameOfPlane(Plane plane) const;
  void Admit();
  std::vector<AdmittedKey> Listed() const;  // with the time since each was heard

  Context* context_;
  KeyFolder folder_;
  Epoch epoch_;
  std::unordered_map<std::string, Time> heard_;  // last, by admitted public key
};

}  // namespace slabstream
