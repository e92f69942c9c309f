#include "gateway/page_link.h"

#include <algorithm>

namespace slabstream {
namespace {

constexpr Duration kPeriod = std::chrono::seconds(10);         // of the least delay: ways change
constexpr std::size_t kMostUnderWay = 16;                      // whatever the page says
constexpr Duration kQuickest = std::chrono::milliseconds(25);  // more pictures a second are not sent ahead

}  // namespace

Duration Smoothed(Duration before, Duration sample) { return before == Duration::zero() ? sample : (3 * before + sample) / 4; }

void PageLink::OnEcho(Duration round_trip, Time now) {
  if (now - period_since_ >= kPeriod) {
    least_[1] = now - period_since_ < 2 * kPeriod ? least_[0] : Duration::zero();
    least_[0] = Duration::zero();
    period_since_ = now;
  }
  least_[0] = least_[0] == Duration::zero() ? round_trip : std::min(least_[0], round_trip);
}

Duration PageLink::delay() const {
  if (least_[0] == Duration::zero() || least_[1] == Duration::zero()) return std::max(least_[0], least_[1]);
  return std::min(least_[0], least_[1]);
}

void PageLink::OnSent(std::uint64_t frame, bool counts, Time now) { under_way_.push_back({frame, counts, now}); }

bool PageLink::OnAck(std::uint64_t frame, Duration in_page, Time now) {
  const auto sent = std::ranges::find(under_way_, frame, &Sent::frame);
  if (sent == under_way_.end()) return false;
  const Time done = now - delay();
  last_ = now - sent->at;
  if (sent->counts) {
    const Duration time = std::max(done - std::max(sent->at, free_since_), Duration(1));
    picture_time_ = Smoothed(picture_time_, time);
    connection_time_ = Smoothed(connection_time_, std::max(time - in_page, Duration(1)));
    round_trip_ = Smoothed(round_trip_, std::max(last_, Duration(1)));
  }
  free_since_ = std::max(free_since_, done);
  under_way_.erase(under_way_.begin(), sent + 1);
  return true;
}

std::size_t PageLink::most_under_way() const {
  if (picture_time_ == Duration::zero() || delay() < kQuickest) return 1;
  const Duration each = std::max(picture_time_, kQuickest);
  return std::min(1 + std::size_t((delay() + each - Duration(1)) / each), kMostUnderWay);
}

Time PageLink::ready() const {
  Time free = free_since_, first{};
  for (const Sent& sent : under_way_) {
    free = std::max(free, sent.at) + picture_time_;
    if (first == Time{}) first = free + delay();  // the first one is acknowledged
  }
  return is_full() ? first : free;
}

}  // namespace slabstream
