#include "worker/service/sent_tallies.h"

namespace slabstream {

void SentTallies::Add(const GroupKey& key, std::uint32_t rank, std::size_t bytes, std::int64_t begin_ns, std::int64_t end_ns) {
  const std::lock_guard lock(mutex_);
  Tally& tally = tallies_[{key, rank}];
  tally.image_bytes += bytes;
  tally.encoding.push_back({Stage::kEncode, begin_ns, end_ns});
}

void SentTallies::MoveInto(const GroupKey& key, std::vector<RankReport>& reports) {
  const std::lock_guard lock(mutex_);
  for (RankReport& report : reports) {
    const auto found = tallies_.find({key, report.rank});
    if (found == tallies_.end()) continue;
    report.image_bytes += found->second.image_bytes;
    for (const Span& span : found->second.encoding) AddStage(report, span.stage, span.begin_ns, span.end_ns);
    tallies_.erase(found);
  }
}

}  // namespace slabstream
