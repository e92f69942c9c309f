// Authenticator: decides who may connect to the encrypted sockets of its Context (ZAP, RFC 27). It has a thread of its own, which ends
// with it. Its functions may be called from any thread.
//
// Without it ZeroMQ would admit every key, so a Context makes one before its first encrypted socket.
#pragma once

#include <memory>
#include <set>
#include <string>

#include "common/base/time.h"

namespace slabstream {

class Context;
class LatestSeals;

class Authenticator {
 public:
  explicit Authenticator(Context& context);  // one a context: Context::authenticator()
  ~Authenticator();

  // Replaces the public keys that may connect to `plane`. Connections that are there stay (Socket::EndConnections ends them).
  void AdmitOnly(const std::string& plane, std::set<std::string> public_keys);

  // The plane's socket is gone.
  void Forget(const std::string& plane);

  // An unknown key is refused at once, and its socket does not try again. On a plane with patience it waits this long to be admitted, and
  // tries again after that. This is for planes that learn keys from messages, which the key's holder may have heard earlier.
  void SetPatience(const std::string& plane, Duration patience);

  // From now on whoever connects to this plane brings the ticket of a seal, and who is admitted enters it there.
  void SetSealed(const std::string& plane, std::shared_ptr<LatestSeals> seals);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace slabstream
