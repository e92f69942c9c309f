// LinkRates: how fast the links to other workers are, as their answers to images tell. Of the thread that sends; knows no clock.
//
//   1. Ask gives the number to put into a message, or 0: then this image is not timed. The first few images to a worker are, later about
//      one a second.
//   2. Sent for everything that is sent there, timed or not: what is queued in front of an image is moved before it.
//   3. Received when the answer to a number comes: what was sent has all arrived by then.
// From one answer the rate is the largest of bytes / time over the last messages sent before it, beginning with any of them: shorter
// stretches leave out what they waited for, longer ones hold idle time. Of the last few answers the best counts: a receiver that had no
// processor for a while is no slow link.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <limits>
#include <map>
#include <optional>

#include "common/base/time.h"
#include "common/wire/ids.h"

namespace slabstream {

class LinkRates {
 public:
  static constexpr std::size_t kAnswers = 4;                       // that count
  static constexpr std::size_t kLeastAnswers = 2;                  // that a rate is known by
  static constexpr Duration kInterval = std::chrono::seconds(1);   // between later questions
  static constexpr Duration kPatience = std::chrono::seconds(30);  // for an answer
  static constexpr double kUnknown = std::numeric_limits<double>::infinity();

  std::uint64_t Ask(WorkerId to, Time now);
  void Sent(WorkerId to, std::uint64_t number, std::size_t bytes, Time now);
  void Received(WorkerId from, std::uint64_t number, Time now);

  // Bytes a second; kUnknown until there are answers.
  double Of(WorkerId worker) const;

  void ForgetAll() { links_.clear(); }

 private:
  static constexpr std::size_t kMessages = 64;  // that are looked back at
  struct Message {
    Time sent;
    std::uint64_t before;  // bytes sent earlier
  };
  struct Link {
    std::deque<Message> messages;
    std::uint64_t bytes = 0;        // sent in all
    std::uint64_t asked = 0;        // number that is not answered; 0: none
    std::optional<Time> asked_at;   // last
    bool was_sent = false;          // the asked one
    std::uint64_t bytes_asked = 0;  // sent in all with it
    Time asked_sent;
    std::deque<double> rates;  // of the last answers
  };
  std::map<WorkerId, Link> links_;
  std::uint64_t last_number_ = 0;
};

}  // namespace slabstream
