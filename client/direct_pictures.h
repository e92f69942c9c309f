// DirectPictures: the client's end of the pictures plane (common/wire/picture_messages.h). Workers send the runs of a picture, or of
// its shares, here. The coordinator sends a FrameReply that names the runs of its picture by their digests. For one thread.
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "common/base/time.h"
#include "common/memory/bytes.h"
#include "common/transport/socket.h"
#include "common/wire/client_messages.h"

namespace slabstream {

class DirectPictures {
 public:
  // Listens on the way to a service with keys. Null: pictures come through the coordinator, since the service is not reached over tcp, or
  // nobody can listen here.
  static std::unique_ptr<DirectPictures> Open(Context& context, const std::string& service_endpoint);
  ~DirectPictures();
  DirectPictures(const DirectPictures&) = delete;
  DirectPictures& operator=(const DirectPictures&) = delete;

  const PicturesDoor& door() const { return door_; }
  std::uint64_t senders() const { return senders_; }  // PictureSenders::version
  Socket& socket() { return socket_; }

  void Admit(const PictureSenders& senders, Time now);

  // Takes what has come; returns the bytes of it.
  std::uint64_t Receive();

  struct Reply {
    FrameReply message;
    std::vector<Bytes> runs;  // the runs of each share; empty: they are direct and have not come, or there are none
  };
  // A reply without some of its runs. They are lost if they do not come until then.
  void Await(Reply reply, Time until) { awaited_.push_back({std::move(reply), until}); }
  // The awaited replies of which all runs have come, in the order in which they were awaited.
  std::vector<Reply> TakeCome();
  struct Lost {
    FrameReply message;
    std::uint64_t missing_bytes = 0;  // of the direct runs that have not come
  };
  std::vector<Lost> TakeLost(Time now);
  Time NextLoss() const;  // Time::max(): nothing is awaited
  void DropUnclaimed();   // the runs that no awaited reply names
  void Clear();           // the service is gone: nobody waits for anything any more

 private:
  struct Awaited {
    Reply reply;
    Time until;
  };
  static constexpr std::uint64_t kMostUnclaimedBytes = std::uint64_t{128} << 20;  // the oldest ones beyond are dropped

  // Fills in the direct runs that have come. False: some are missing.
  bool Complete(Reply& reply);
  // The runs with this digest, if they have come.
  std::optional<Bytes> Take(std::uint64_t digest, std::uint64_t bytes);

  DirectPictures(Context& context, Socket socket, PicturesDoor door, std::string plane)
      : context_(context), socket_(std::move(socket)), door_(std::move(door)), plane_(std::move(plane)) {}

  Context& context_;
  Socket socket_;
  const PicturesDoor door_;
  const std::string plane_;
  std::uint64_t senders_ = 0;
  std::set<std::string> admitted_;
  std::map<std::string, Time> left_;                     // keys that are admitted no more, and since when
  std::deque<std::pair<std::uint64_t, Bytes>> arrived_;  // by digest, oldest first
  std::uint64_t arrived_bytes_ = 0;
  std::vector<Awaited> awaited_;
};

}  // namespace slabstream
