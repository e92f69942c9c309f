#include "worker/known_peers.h"

#include <algorithm>
#include <set>

namespace slabstream {

void KnownPeers::Name(const Peer& peer) {
  const auto known = peers_.find(peer.worker);
  if (known != peers_.end() && known->second == peer) return;
  peers_[peer.worker] = peer;
  if (authenticator_ != nullptr && !peer.images_key.empty()) authenticator_->Admit(plane_, peer.images_key);
}

void KnownPeers::Gone(std::span<const WorkerId> workers, Socket& images) {
  std::set<std::string> ended;
  for (const WorkerId worker : workers) {
    const auto gone = peers_.find(worker);
    if (gone == peers_.end()) continue;
    ended.insert(gone->second.images_key);
    peers_.erase(gone);
  }
  std::erase_if(ended, [this](const std::string& key) { return key.empty() || IsNamed(key); });
  if (authenticator_ == nullptr || ended.empty()) return;
  std::set<std::string> admitted;
  for (const auto& [worker, peer] : peers_) admitted.insert(peer.images_key);
  authenticator_->AdmitOnly(plane_, std::move(admitted));
  for (const std::string& key : ended) images.EndConnections(key);
}

void KnownPeers::ForgetAll() {
  peers_.clear();
  if (authenticator_ != nullptr) authenticator_->AdmitOnly(plane_, {});
}

const Peer* KnownPeers::Find(WorkerId worker) const {
  const auto found = peers_.find(worker);
  return found == peers_.end() ? nullptr : &found->second;
}

bool KnownPeers::IsNamed(const std::string& images_key) const {
  return std::ranges::any_of(peers_, [&](const auto& entry) { return entry.second.images_key == images_key; });
}

}  // namespace slabstream
