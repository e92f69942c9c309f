// PictureSockets: the sending ends of the pictures plane, one DEALER for each client that this worker has made pictures for lately.
//
// A connection is made while the frame is still rendered. A client that cannot be reached, or not yet, gets its picture through the
// coordinator.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <utility>

#include "common/base/bytes.h"
#include "common/base/time.h"
#include "common/transport/socket.h"
#include "common/wire/picture_messages.h"

namespace slabstream {

class PictureSockets {
 public:
  // A client may name one key after another. Beyond so many, clients get their pictures through the coordinator.
  static constexpr std::size_t kMostConnections = 256;

  // `own`: the keys of this worker's images plane.
  PictureSockets(Context& context, std::optional<KeyPair> own) : context_(context), own_(std::move(own)) {}

  // Begins to connect, if it has not. Nothing happens without keys, or if there are kMostConnections already.
  void Prepare(const PicturesAddress& to, Time now);
  // False: there is no connection, or too much is queued for it.
  bool Send(const PicturesAddress& to, const SentPicture& message, const Bytes& payload, Time now);
  void CloseIdle(Time now);
  std::size_t size() const { return connections_.size(); }

 private:
  struct Connection {
    Socket socket;
    Time last_used;
  };
  Context& context_;
  const std::optional<KeyPair> own_;
  std::map<std::string, Connection> connections_;  // by the client's key
};

}  // namespace slabstream
