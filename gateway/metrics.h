// Metrics: what the gateway counts, and its text for Prometheus. Any thread.
#pragma once

#include <cstdint>
#include <map>
#include <mutex>
#include <string>
#include <string_view>

#include "common/base/time.h"
#include "common/metrics/exposition.h"
#include "common/otlp/trace_sender.h"
#include "common/wire/client_messages.h"
#include "gateway/service_news.h"

namespace slabstream {

class Metrics {
 public:
  // A picture came from the service.
  void CountFrame(const FrameStatistics& statistics, Duration latency);
  // A picture was encoded: `type` is "jpeg" or "png".
  void CountPicture(std::string_view type, std::size_t bytes, Duration encoding);
  // The service answered a question ("histogram", "value", "pick", "transfer").
  void CountAnswer(std::string_view question, Duration latency);
  // From sending a picture to the page's acknowledgement.
  void CountRoundTrip(Duration round_trip);
  // A request over HTTP, by its status.
  void CountResponse(unsigned status);
  // A session or request that was refused or dropped: "token", "origin", "sessions", "slow reader", ...
  void CountRefusal(std::string_view reason);
  void CountSession(int change);  // +1, -1

  // In the text format of Prometheus, with what the service says of itself, and how many traces went to a collector.
  std::string Text(const ServiceNews& news, const TraceSender::Counts& traces) const;

 private:
  void Observe(std::string_view stage, std::int64_t ns);  // with the mutex held

  mutable std::mutex mutex_;
  std::map<std::string, TimeHistogram, std::less<>> stages_;  // by stage
  std::map<std::string, std::uint64_t, std::less<>> pictures_, bytes_, refusals_, answers_;
  std::map<unsigned, std::uint64_t> responses_;
  std::uint64_t frames_ = 0, voxel_reports_ = 0, voxel_hits_ = 0;
  int sessions_ = 0;
};

}  // namespace slabstream
