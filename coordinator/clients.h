// ClientTable: the clients that have asked for frames, when each was last heard, and the last answers sent to each. Answers are kept within
// limits, so that a client that repeats a request (its connection broke, say) gets the kept answer and the work is not repeated.
#pragma once

#include <cstddef>
#include <deque>
#include <map>
#include <vector>

#include "common/base/bytes.h"
#include "common/base/time.h"
#include "common/wire/any_message.h"
#include "coordinator/peer_token.h"

namespace slabstream {

inline constexpr std::size_t kMaxKeptAnswers = 64;  // of one client
// Payloads of one client's kept answers. Few: answers are hardly ever asked for again, and a kept picture holds a buffer that the next
// picture could use while it is still in a cache.
inline constexpr std::size_t kMaxKeptAnswerBytes = std::size_t{8} << 20;

// What ended a request: its final FrameReply, or FrameFailed.
struct Answer {
  RequestId request = 0;
  AnyMessage message;
  Bytes payload;
  Time sent;
};

class ClientTable {
 public:
  explicit ClientTable(Duration client_timeout) : timeout_(client_timeout) {}

  void Meet(PeerToken client, Time now);   // heard; from now on it has an entry
  void Touch(PeerToken client, Time now);  // heard, if it has one
  bool Forget(PeerToken client);           // true: it had one
  void Postpone(Duration duration);        // all silences begin later, since the listener itself was asleep

  std::vector<PeerToken> Silent(Time now) const;
  std::size_t size() const { return clients_.size(); }
  Time NextWake() const;  // the next silence

  // Keeps the answer, dropping the oldest ones beyond the limits (this one too if it is too large). The client must be known.
  void Keep(PeerToken client, Answer answer);
  Answer* FindAnswer(PeerToken client, RequestId request);  // null: none kept

 private:
  struct Client {
    Time last_heard;
    std::deque<Answer> answers;  // oldest first
    std::size_t answer_bytes = 0;
  };
  Duration timeout_;
  std::map<PeerToken, Client> clients_;
};

}  // namespace slabstream
