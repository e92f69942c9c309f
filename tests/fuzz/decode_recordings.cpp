// Traces that hold a recording, and so the reader of JSON that recordings and sweeps share.
#include <cmath>

#include "client/cli/recording.h"
#include "common/json/json.h"
#include "tests/fuzz/decoders.h"
#include "tests/laboratory/measure/recorded.h"

namespace slabstream {
namespace {

std::string TextOf(const std::vector<RecordedFrame>& frames) { return Json{{kRecordingKey, RecordingJson(frames)}}.dump(); }

// A time is written in microseconds since the first frame, with three digits behind the point.
void CheckNear(double a, double b) { CHECK_LE(std::abs(a - b), 1e-9 + 1e-12 * std::abs(a)) << a << " against " << b; }

void CheckSame(const RecordedFrame& a, const RecordedFrame& b) {
  CHECK(a.renderer == b.renderer && a.grid == b.grid && a.workers == b.workers && a.display == b.display && a.combine == b.combine);
  CHECK_EQ(a.image_bytes, b.image_bytes);
  CHECK_EQ(a.voxel_bytes, b.voxel_bytes);
  CheckNear(a.latency, b.latency);
  CheckNear(a.picture_seconds, b.picture_seconds);
  CHECK_EQ(a.groups.size(), b.groups.size());
  for (std::size_t g = 0; g < a.groups.size(); ++g) {
    CHECK_EQ(a.groups[g].size(), b.groups[g].size());
    for (std::size_t rank = 0; rank < a.groups[g].size(); ++rank) {
      const RecordedRank &x = a.groups[g][rank], &y = b.groups[g][rank];
      CHECK(x.box == y.box && x.worker == y.worker && x.bounds == y.bounds && x.pixels == y.pixels);
      CheckNear(x.render_seconds, y.render_seconds);
    }
  }
}

// Times of a day at most; the distance of two that are far apart is out of the reader's range.
bool Plausible(const std::vector<RecordedFrame>& frames) {
  constexpr double kDay = 86400;
  for (const RecordedFrame& frame : frames) {
    for (const double time : {frame.arrived, frame.begin, frame.end}) {
      if (std::abs(time) > kDay) return false;
    }
  }
  return true;
}

}  // namespace

bool DecodeRecording(std::span<const std::byte> bytes) {
  const Result<std::vector<RecordedFrame>> frames = ParseRecording(FuzzInput(bytes).Text());
  if (!frames.ok()) {
    CheckRefusal(frames.status());
    return false;
  }
  CHECK(!frames->empty());
  for (const RecordedFrame& frame : *frames) {
    CHECK(!frame.grid.empty());
    for (const auto& group : frame.groups) {
      for (const RecordedRank& rank : group) CHECK(frame.grid.Contains(rank.bounds));
    }
  }
  if (!Plausible(*frames)) return true;
  const Result<std::vector<RecordedFrame>> again = ParseRecording(TextOf(*frames));
  CHECK(again.ok()) << again.status().message();
  CHECK_EQ(again->size(), frames->size());
  for (std::size_t i = 0; i < frames->size(); ++i) CheckSame((*frames)[i], (*again)[i]);
  return true;
}

std::vector<FuzzBytes> RecordingSeeds() {
  Random random(46);
  std::vector<FuzzBytes> seeds;
  for (int i = 0; i < 4; ++i) seeds.push_back(SeedOf(TextOf(RandomRecording(random, random.Integer(1, 2), random.Integer(1U, 4U)))));
  return seeds;
}

}  // namespace slabstream
