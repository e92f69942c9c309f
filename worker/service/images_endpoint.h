// ImagesEndpoint: where images come to a worker. Unless somebody chose it, that is the address from which this host reaches the
// coordinator, and follows it: hosts get other addresses while they run.
#pragma once

#include <optional>
#include <string>

#include "common/base/status.h"
#include "common/transport/endpoint.h"
#include "common/transport/socket.h"
#include "common/wire/ids.h"

namespace slabstream {

class ImagesEndpoint {
 public:
  // Binds `images` at `wanted`; empty: any port on the way to the coordinator (tcp), a path beside its own (ipc), a name (inproc). Errors:
  // as Socket::Bind and LocalHostTowards.
  static Result<ImagesEndpoint> Bind(Socket& images, const std::string& wanted, Endpoint coordinator, Incarnation incarnation);

  const std::string& text() const { return text_; }

  // `local_host`: the address from which the coordinator was reached last; empty: not known. If it is another one than before, images come
  // there from now on, beside the endpoints before. Then returns the endpoint.
  std::optional<std::string> Follow(Socket& images, const std::string& local_host);

 private:
  std::string text_;
  std::string host_;  // the host that it follows; empty: none
};

}  // namespace slabstream
