// LinkRates: estimates the speed of the links to other workers from their answers to images. Belongs to the sending thread; reads no clock.
//
//   1. Ask returns the number to put into a message, or 0 if this image is not timed. The first few images to a worker are timed, later
//      about one a second.
//   2. Call Sent for everything sent to the worker, timed or not: bytes queued in front of an image move before it.
//   3. Call Received when the answer to a number arrives: by then everything sent so far has arrived.
// One answer gives the rate as the maximum of bytes / time over the last messages sent before it, for every possible first message: shorter
// stretches leave out what they waited for, longer ones hold idle time. The best of the last few answers counts, since a receiver that
// lacked a processor for a while is not a slow link.
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
  static constexpr std::size_t kAnswers = 4;                       // answers that count
  static constexpr std::size_t kLeastAnswers = 2;                  // needed before a rate is known
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
  static constexpr std::size_t kMessages = 64;  // the last messages that an answer considers
  struct Message {
    Time sent;
    std::uint64_t before;  // bytes sent earlier
  };
  struct Link {
    std::deque<Message> messages;
    std::uint64_t bytes = 0;        // sent in all
    std::uint64_t asked = 0;        // number without an answer yet; 0: none
    std::optional<Time> asked_at;   // last
    bool was_sent = false;          // whether the message with that number was sent
    std::uint64_t bytes_asked = 0;  // bytes sent in all, up to and including that message
    Time asked_sent;
    std::deque<double> rates;  // the rates that the last answers gave
  };
  std::map<WorkerId, Link> links_;
  std::uint64_t last_number_ = 0;
};

}  // namespace slabstream
