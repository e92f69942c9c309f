// PictureSockets: the sending ends of the pictures plane, one DEALER for each client that this worker has made pictures for lately.
//
// A connection is made while the frame is still rendered. A client that cannot be reached, or not yet, gets its picture through the
// coordinator. So does one that has not taken its earlier pictures, whatever it says about them: what waits here takes this worker's
// memory. A connection that takes nothing for a while is closed, and what waits for it is dropped.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>

#include "common/base/time.h"
#include "common/memory/bytes.h"
#include "common/transport/socket.h"
#include "common/wire/picture_messages.h"

namespace slabstream {

class PictureSockets {
 public:
  // A client may name one key after another. Beyond so many, clients get their pictures through the coordinator.
  static constexpr std::size_t kMostConnections = 256;

  // `own`: the keys of this worker's images plane. `most_unsent`: bytes of pictures that may wait; one more picture may be under way.
  PictureSockets(Context& context, std::optional<KeyPair> own, std::uint64_t most_unsent)
      : context_(context), own_(std::move(own)), most_unsent_(most_unsent) {}

  // Begins to connect, if it has not. Nothing happens without keys, or if there are kMostConnections already.
  void Prepare(const PicturesAddress& to, Time now);
  // False: there is no connection, or too much waits.
  bool Send(const PicturesAddress& to, const SentPicture& message, const Bytes& payload, Time now);
  // Closes those that were not used, or took nothing, for a while.
  void CloseIdle(Time now);
  std::size_t size() const { return connections_.size(); }

 private:
  struct Connection {
    Socket socket;
    Time last_used;
    std::uint64_t unsent = 0;  // when it was last looked at
    Time moved;                // when that was less than before, or 0
  };
  std::uint64_t Unsent() const;

  Context& context_;
  const std::optional<KeyPair> own_;
  const std::uint64_t most_unsent_;
  std::map<std::string, Connection> connections_;  // by the client's key
};

}  // namespace slabstream
