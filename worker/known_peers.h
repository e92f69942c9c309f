// KnownPeers: the workers that the coordinator has named, and with them the keys that this worker's images plane admits.
//
// A key is admitted from the first group that names its worker until the coordinator says that the worker has gone, or until this worker
// registers anew, since it may not have heard of all who went meanwhile.
#pragma once

#include <map>
#include <optional>
#include <span>
#include <string>
#include <utility>

#include "common/transport/authenticator.h"
#include "common/transport/socket.h"
#include "common/wire/control_messages.h"

namespace slabstream {

class KnownPeers {
 public:
  // `plane`: of the images socket. Null and empty: it has no keys.
  KnownPeers(Authenticator* authenticator, std::string plane) : authenticator_(authenticator), plane_(std::move(plane)) {}

  void Name(const Peer& peer);
  // Ends the connections of those who have gone to `images`, unless they are workers again, under another id.
  void Gone(std::span<const WorkerId> workers, Socket& images);
  void ForgetAll();

  const Peer* Find(WorkerId worker) const;  // null: not named, or gone

 private:
  bool IsNamed(const std::string& images_key) const;

  Authenticator* const authenticator_;
  const std::string plane_;
  std::map<WorkerId, Peer> peers_;
};

}  // namespace slabstream
