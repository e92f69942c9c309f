// ClientTable: the clients that have asked for frames, when each was last heard, and the last answers sent to each. Answers are kept within
// limits, so that a client that repeats a request (its connection broke, say) gets the kept answer and the work is not repeated. And how
// much of what was sent to each it has not read yet.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <vector>

#include "common/base/time.h"
#include "common/memory/bytes.h"
#include "common/wire/any_message.h"
#include "coordinator/peer_token.h"

namespace slabstream {

// Bytes of payloads that were sent to a client and that it has not read: with so many or more it is behind.
inline constexpr std::uint64_t kMaxUnreadBytes = std::uint64_t{128} << 20;
inline constexpr std::uint64_t kLeastUnreadPart = std::uint64_t{4} << 20;  // more than a client reads before it says so
inline constexpr std::size_t kMaxKeptAnswers = 64;                         // answers kept for one client
// Bytes of the payloads of one client's kept answers. Few, since answers are hardly ever asked for again, and since a picture that is kept
// holds a buffer that the next picture could use while it is still in a cache.
inline constexpr std::size_t kMaxKeptAnswerBytes = std::size_t{8} << 20;
inline constexpr std::size_t kKeptAnswerBytesOfAll = std::size_t{64} << 20;  // many clients share them: each has an equal part

// What ended a request: its final FrameReply, or FrameFailed.
struct Answer {
  RequestId request = 0;
  CoordinatorToClient message;
  Bytes payload;
  Time sent;
};

class ClientTable {
 public:
  // `most_unread`: if all clients together leave so many bytes unread, each may have an equal part of them, and at least kLeastUnreadPart.
  // So at most twice as many are unread, or kLeastUnreadPart of each client beside them, and a picture of each client.
  explicit ClientTable(Duration client_timeout, std::uint64_t most_unread = UINT64_MAX)
      : timeout_(client_timeout), most_unread_(most_unread) {}

  void Meet(PeerToken client, Time now);   // heard; from now on it has an entry
  void Touch(PeerToken client, Time now);  // heard, if it has one
  bool Forget(PeerToken client);           // true: it had one
  void Postpone(Duration duration);        // all silences begin later, since the listener itself was asleep

  std::vector<PeerToken> Silent(Time now) const;
  std::size_t size() const { return clients_.size(); }
  Time NextWake() const;  // the next silence

  void Sent(PeerToken client, std::size_t bytes);
  // What it says to have read since its connection began. Bytes that have not left this process it cannot have read.
  void Read(PeerToken client, std::uint64_t bytes, std::uint64_t unsent = 0);
  // It has left kMaxUnreadBytes unread, or its part of most_unread. A client that is behind gets no previews, and none of its frames
  // begins.
  bool IsBehind(PeerToken client) const;

  // Keeps the answer, dropping the oldest ones beyond the limits (this one too if it is too large). The client must be known.
  void Keep(PeerToken client, Answer answer);
  Answer* FindAnswer(PeerToken client, RequestId request);  // null: none kept

 private:
  struct Client {
    Time last_heard;
    std::deque<Answer> answers;  // oldest first
    std::size_t answer_bytes = 0;
    std::uint64_t sent_bytes = 0, read_bytes = 0;
    std::optional<std::uint64_t> read_before;  // what it said first: bytes of an earlier connection

    std::uint64_t unread() const { return sent_bytes - read_bytes; }
  };
  Duration timeout_;
  std::uint64_t most_unread_;
  std::uint64_t unread_of_all_ = 0;
  std::map<PeerToken, Client> clients_;
};

}  // namespace slabstream
