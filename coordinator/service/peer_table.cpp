#include "coordinator/service/peer_table.h"

namespace slabstream {

PeerToken PeerTable::Heard(const std::string& identity, Time now) {
  const auto [entry, fresh] = tokens_.try_emplace(identity, last_token_ + 1);
  if (fresh) peers_.emplace(++last_token_, Peer{identity, now});
  peers_.at(entry->second).last_heard = now;
  return entry->second;
}

const std::string* PeerTable::IdentityOf(PeerToken token) const {
  const auto found = peers_.find(token);
  return found == peers_.end() ? nullptr : &found->second.identity;
}

void PeerTable::Forget(PeerToken token) {
  const auto found = peers_.find(token);
  if (found == peers_.end()) return;
  tokens_.erase(found->second.identity);
  peers_.erase(found);
}

void PeerTable::ForgetSilentSince(Time limit) {
  std::erase_if(tokens_, [&](const auto& entry) { return peers_.at(entry.second).last_heard < limit; });
  std::erase_if(peers_, [&](const auto& entry) { return entry.second.last_heard < limit; });
}

}  // namespace slabstream
