#include "worker/sent_tallies.h"

#include <algorithm>

namespace slabstream {

void SentTallies::Add(const GroupKey& key, std::uint32_t rank, std::size_t bytes, std::int64_t begin_ns, std::int64_t end_ns) {
  const std::lock_guard lock(mutex_);
  RankReport& tally = tallies_[{key, rank}];
  tally.image_bytes += bytes;
  AddStage(tally, Stage::kEncode, begin_ns, end_ns);
}

void SentTallies::MoveInto(const GroupKey& key, std::vector<RankReport>& reports) {
  const std::lock_guard lock(mutex_);
  for (RankReport& report : reports) {
    const auto found = tallies_.find({key, report.rank});
    if (found == tallies_.end()) continue;
    const RankReport& tally = found->second;
    report.image_bytes += tally.image_bytes;
    report.stage_ns[std::size_t(Stage::kEncode)] += tally.stage_ns[std::size_t(Stage::kEncode)];
    const std::size_t room = std::size_t(kMaxSpans) - std::min(report.spans.size(), std::size_t(kMaxSpans));
    report.spans.insert(report.spans.end(), tally.spans.begin(), tally.spans.begin() + std::ptrdiff_t(std::min(room, tally.spans.size())));
    tallies_.erase(found);
  }
}

}  // namespace slabstream
