// PeerTable: the state machine's names (PeerToken) for the connections of one ROUTER (identities). Tokens are never reused.
#pragma once

#include <string>
#include <unordered_map>

#include "common/base/time.h"
#include "coordinator/peer_token.h"

namespace slabstream {

class PeerTable {
 public:
  // Token of the sender of a message that arrived now; a new one for an unknown identity.
  PeerToken Heard(const std::string& identity, Time now);

  const std::string* IdentityOf(PeerToken token) const;  // null: forgotten

  void Forget(PeerToken token);

  // Forgets connections that were last heard before `limit`, so that many short connections do not fill the memory of a long life. A peer
  // with work in the service sends something every second and is never forgotten.
  void ForgetSilentSince(Time limit);

  std::size_t size() const { return peers_.size(); }

 private:
  struct Peer {
    std::string identity;
    Time last_heard;
  };
  PeerToken last_token_ = 0;
  std::unordered_map<PeerToken, Peer> peers_;
  std::unordered_map<std::string, PeerToken> tokens_;
};

}  // namespace slabstream
