#include "coordinator/service/service_keys.h"

#include <fmt/format.h>

#include <chrono>

#include "common/transport/authenticator.h"

namespace slabstream {

Result<ServiceKeys> ServiceKeys::Open(Context& context, const std::string& folder, Epoch epoch) {
  Result<KeyFolder> keys = KeyFolder::Open(folder);
  if (!keys.ok()) return keys.status();
  ServiceKeys service(context, *std::move(keys), epoch);
  service.Admit();  // before a plane is bound: whoever is refused does not try again
  return service;
}

// Services of one process share its authenticator.
std::string ServiceKeys::NameOfPlane(Plane plane) const { return fmt::format("{}-{:x}", NameOf(plane), epoch_); }

ServerKeys ServiceKeys::For(Plane plane) const { return {folder_.server().secret_key, NameOfPlane(plane)}; }

Status ServiceKeys::Publish(const std::string& client_endpoint, const std::string& worker_endpoint) {
  Status published = folder_.Publish({client_endpoint, worker_endpoint, epoch_});
  if (published.ok()) Admit();
  return published;
}

void ServiceKeys::Admit() {
  Authenticator& authenticator = context_->authenticator();
  authenticator.AdmitOnly(NameOfPlane(Plane::kClient), folder_.KeysOf({Role::kClient, Role::kAdmin}));
  authenticator.AdmitOnly(NameOfPlane(Plane::kControl), folder_.KeysOf({Role::kWorker, Role::kOwner}));
  authenticator.AdmitOnly(NameOfPlane(Plane::kVoxels), folder_.KeysOf({Role::kWorker}));
}

std::optional<Role> ServiceKeys::RoleOf(const Incoming& incoming) {
  const AdmittedKey* const key = folder_.Find(incoming.user);
  if (key == nullptr) return std::nullopt;
  heard_[key->public_key] = MonotonicNow();
  return key->role;
}

std::vector<AdmittedKey> ServiceKeys::Listed() const {
  std::vector<AdmittedKey> keys = folder_.admitted();
  const Time now = MonotonicNow();
  for (AdmittedKey& key : keys) {
    const auto heard = heard_.find(key.public_key);
    if (heard != heard_.end()) key.silent_ms = std::uint64_t((now - heard->second) / std::chrono::milliseconds(1));
  }
  return keys;
}

ServiceKeys::Done ServiceKeys::CarryOut(const KeysOrder& order) {
  Done done;
  Status status;
  if (order.action == KeysAction::kRotate) {
    status = folder_.Rotate(order.role).status();
  } else if (order.action == KeysAction::kRevoke) {
    const Result<std::string> revoked = folder_.Revoke(order.key);
    status = revoked.status();
    if (revoked.ok()) done.revoked = *revoked;
    if (revoked.ok()) heard_.erase(*revoked);
  } else if (order.action == KeysAction::kIssue) {
    status = folder_.Issue(order.key, order.role, order.name).status();
  }
  if (!status.ok()) {
    done.answer = OrderRefused{order.nonce, status};
    return done;
  }
  Admit();
  done.answer = KeysReply{order.nonce, Listed()};
  return done;
}

}  // namespace slabstream
