// PageLink: estimates from a page's answers how long a picture takes to get there, how many may be under way, and when the next one should
// be sent. Pure: events and the time go in.
//
// A picture's round trip has two parts. The delay is what an empty message takes there and back, however fast the connection is: while it
// passes, more pictures can be sent. The rest is the picture's own time, on the connection and in the page: only when it is over, the next
// picture gets there. Far away the delay is long and pictures are quick; on a slow connection it is the other way round. The page reports
// how long it worked on each picture itself.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <deque>

#include "common/base/time.h"

namespace slabstream {

// The mean of samples so far with one more; the latest ones count most. 0 before: there is none yet.
Duration Smoothed(Duration before, Duration sample);

class PageLink {
 public:
  // A round trip of a message that is next to nothing. The least one of the last 10 to 20 s is the delay: 0 before the first.
  void OnEcho(Duration round_trip, Time now);
  // `frame` rises. Lossless pictures, which are larger, say nothing about the others' time: they do not count.
  void OnSent(std::uint64_t frame, bool counts, Time now);
  // The page has drawn `frame` and all before it, and took the time `in_page` for it. false: it is not under way.
  bool OnAck(std::uint64_t frame, Duration in_page, Time now);

  // true: the page should acknowledge a picture before the next one is sent. Under way may be one, and one more for each picture's time,
  // but at least 25 ms, that fits into the delay; at most 16. Only one, if the delay is below 25 ms, or no picture's time is known yet.
  bool is_full() const { return under_way_.size() >= most_under_way(); }
  // When the next picture can get through at once; passed, if it can now.
  Time ready() const;
  Duration connection_time() const { return connection_time_; }  // of a picture's time, without the page's; smoothed, 0: not measured yet
  Duration picture_time() const { return picture_time_; }        // smoothed; 0: not measured yet
  Duration round_trip() const { return round_trip_; }            // smoothed; 0: not measured yet
  Duration last_round_trip() const { return last_; }
  Duration delay() const;

 private:
  struct Sent {
    std::uint64_t frame = 0;
    bool counts = false;
    Time at{};
  };
  std::size_t most_under_way() const;

  std::deque<Sent> under_way_;
  std::array<Duration, 2> least_{};  // delays of this period and of the one before; 0: none
  Time period_since_{};
  Time free_since_{};  // the way was done with the last acknowledged picture
  Duration connection_time_{}, picture_time_{}, round_trip_{}, last_{};
};

}  // namespace slabstream
