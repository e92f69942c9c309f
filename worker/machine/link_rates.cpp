#include "worker/machine/link_rates.h"

#include <algorithm>

#include "common/wire/image_messages.h"

namespace slabstream {

std::uint64_t LinkRates::Ask(WorkerId to, Time now) {
  Link& link = links_[to];
  const bool waits = link.asked != 0 && now - *link.asked_at < kPatience;
  const bool knows = link.rates.size() >= kAnswers && link.asked_at && now - *link.asked_at < kInterval;
  if (waits || knows) return 0;
  link.asked = ++last_number_;
  link.asked_at = now;
  link.was_sent = false;
  return link.asked;
}

void LinkRates::Sent(WorkerId to, std::uint64_t number, std::size_t bytes, Time now) {
  Link& link = links_[to];
  link.messages.push_back({now, link.bytes});
  if (link.messages.size() > kMessages) link.messages.pop_front();
  link.bytes += bytes;
  if (number == 0 || number != link.asked) return;
  if (bytes < kLeastAcknowledgedBytes) {  // there will be no answer
    link.asked = 0;
    link.asked_at.reset();
    return;
  }
  link.was_sent = true;
  link.bytes_asked = link.bytes;
  link.asked_sent = now;
}

void LinkRates::Received(WorkerId from, std::uint64_t number, Time now) {
  const auto found = links_.find(from);
  if (found == links_.end() || number == 0 || found->second.asked != number || !found->second.was_sent) return;
  Link& link = found->second;
  link.asked = 0;
  double best = 0;
  for (const Message& message : link.messages) {
    if (message.sent > link.asked_sent || message.before >= link.bytes_asked) break;
    const double seconds = std::max(std::chrono::duration<double>(now - message.sent).count(), 1e-9);
    best = std::max(best, double(link.bytes_asked - message.before) / seconds);
  }
  if (best == 0) return;  // more messages have been sent since than are remembered
  link.rates.push_back(best);
  if (link.rates.size() > kAnswers) link.rates.pop_front();
}

double LinkRates::Of(WorkerId worker) const {
  const auto found = links_.find(worker);
  if (found == links_.end() || found->second.rates.size() < kLeastAnswers) return kUnknown;
  return *std::ranges::max_element(found->second.rates);
}

}  // namespace slabstream
