#include "tests/simulator/frame_witness.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "common/planning/frame_occlusion.h"
#include "common/planning/frame_window.h"
#include "tests/simulator/model_occlusion.h"
#include "tests/simulator/model_worker.h"

namespace slabstream {
namespace {

// Whether a plane between two boxes has `near` on the eye's side, or no ray through it.
bool MayComeFirst(const Camera& camera, const Box& near, const Box& far) {
  return std::any_of(kAxes.begin(), kAxes.end(), [&](Axis axis) {
    const bool lower_first =
        camera.projection == Projection::kOrthographic ? camera.view_direction[axis] >= 0 : camera.eye[axis] <= far.begin[axis] - 0.5;
    const bool upper_first =
        camera.projection == Projection::kOrthographic ? camera.view_direction[axis] <= 0 : camera.eye[axis] >= far.end[axis] - 0.5;
    return (near.end[axis] <= far.begin[axis] && lower_first) || (near.begin[axis] >= far.end[axis] && upper_first);
  });
}

// Whether `seen`, a pixel of the frame, shows all boxes of `expected` but those that may be missing: a box behind an opaque one, or one
// that a mask hides at this pixel.
bool LacksHiddenBoxesOnly(const SymbolicPixel& seen, const SymbolicPixel& expected, const std::map<BoxId, OcclusionMask>& left_out,
                          std::int32_t x, std::int32_t y) {
  auto at = seen.begin();
  bool hidden = false;
  for (const BoxId box : expected) {
    const bool here = at != seen.end() && *at == box;
    if (here) ++at;
    const auto mask = left_out.find(box);
    if (!here && !hidden && (mask == left_out.end() || !mask->second.Hides(x, y))) return false;
    hidden = hidden || (here && IsOpaque(box, x / kOcclusionTile, y / kOcclusionTile));
  }
  return at == seen.end();
}

}  // namespace

void FrameWitness::OnRestart() {
  frames_.clear();
  fetched_.clear();
}

void FrameWitness::OnPing(const Ping& ping) {
  for (auto& [id, frame] : frames_) {
    const bool cancelled = std::find(ping.cancelled.begin(), ping.cancelled.end(), id) != ping.cancelled.end();
    frame.over = frame.over || cancelled || id < ping.finished_before;
  }
}

void FrameWitness::OnGroupDone(const GroupDone& done) {
  const auto frame = frames_.find(done.key.frame);
  if (frame == frames_.end()) return;
  std::uint32_t& groups = frame->second.done[done.worker];
  groups = std::max(groups, done.key.group + 1);
}

void FrameWitness::OnAssignment(const GroupAssignment& assignment, std::size_t workers, int teams) {
  SeenFrame& frame = frames_[assignment.key.frame];
  if (assignment.key.attempt > frame.attempt) {
    if (frame.attempt > 0) tally_.Add(Count::kAttempts);
    frame.attempt = assignment.key.attempt;
    frame.handed_out.clear();
  }
  ASSERT_EQ(assignment.setup.camera.supersample, 1);
  if (!frame.handed_out.empty() || !frame.groups.empty()) {
    EXPECT_EQ(assignment.setup.dataset, frame.setup.dataset) << "a frame of two sets of voxels";
  }
  frame.group_count = assignment.group_count;
  frame.client = assignment.client;
  frame.setup = assignment.setup;
  frame.handed_out.insert(assignment.key.group);
  frame.display = assignment.display;
  std::vector<BoxId> boxes;
  for (const Placement& placement : assignment.group.placements) {
    boxes.push_back(placement.id);
    frame.boxes[placement.id] = placement.box;
    if (assignment.setup.stored && ReachOf(placement.box, assignment.setup).empty()) {
      frame.outside.insert(placement.id);
      continue;
    }
    Box& last = last_boxes_.try_emplace(placement.id, placement.box).first->second;
    if (faultless_ && last != placement.box) tally_.Add(Count::kMovedBoxes);
    last = placement.box;
    const OcclusionMask before = MaskBefore(placement.box, assignment.setup), hidden = Union(assignment.hidden, before);
    if (!before.empty()) tally_.Add(Count::kFronts);
    OcclusionMask& left_out = frame.left_out[placement.id];
    left_out = Union(left_out, hidden);
    if (HidesBox(hidden, placement.box, assignment.setup)) {
      std::ranges::fill(left_out.steps, kOcclusionSteps);  // the model's boxes reach all pixels
      tally_.Add(Count::kHiddenBoxes);
      continue;
    }
    const std::pair<WorkerId, Box> padded{placement.worker, PaddedBox(placement.at(), assignment.setup)};
    frame.padded_boxes.insert(padded);
    if (fetched_.count(padded) == 0) frame.all_cached = false;
  }
  const auto [known, added] = frame.groups.emplace(assignment.key.group, boxes);
  EXPECT_EQ(known->second, boxes) << "another attempt has other boxes";
  if (!assignment.hidden.empty()) CheckHidden(assignment, frame);

  std::size_t unfinished = 0, of_client = 0;
  for (const auto& [id, other] : frames_) {
    if (other.over) continue;
    unfinished += other.unfinished();
    if (other.client == assignment.client) of_client += other.unfinished();
  }
  // While frames wait for their next attempt, the groups of the last one, which may have had the window to itself, are still out but no
  // longer counted.
  const FrameWindow window = WindowFor(workers, std::uint32_t(teams), FrameBytes(assignment.setup));
  if (of_client > 2) {  // the first two may be beyond the window, as may be those of others
    const std::size_t beyond = 2 * OthersThan(assignment.client);
    const std::size_t counted = std::size_t(window.groups), waiting = std::size_t(window.frames) - 1 + beyond;
    EXPECT_LE(unfinished, counted + (faultless_ ? 0 : counted * waiting) + beyond);
  }
  if (faultless_ && UsesOcclusion(assignment.setup)) {
    EXPECT_LE(frame.unfinished(), std::size_t(kMaskedGroups));
  }
}

// Clients with groups on their way.
std::size_t FrameWitness::OthersThan(ClientId client) const {
  std::set<ClientId> others;
  for (const auto& [id, frame] : frames_) {
    if (!frame.over && frame.unfinished() > 0 && frame.client != client) others.insert(frame.client);
  }
  return others.size();
}

void FrameWitness::CheckHidden(const GroupAssignment& assignment, const SeenFrame& frame) {
  tally_.Add(Count::kMasks);
  if (assignment.key.attempt > 1) tally_.Add(Count::kMasksOfRetries);
  const Status fits = CheckFits(assignment.hidden, assignment.setup);
  EXPECT_TRUE(fits.ok()) << fits.message();
  const auto done = frame.done.find(assignment.display);
  const std::uint32_t in_front = std::min(assignment.key.group, done == frame.done.end() ? 0 : done->second);
  std::vector<BoxId> boxes;
  for (std::uint32_t group = 0; group < in_front; ++group) {
    const std::vector<BoxId>& more = frame.groups.at(group);
    boxes.insert(boxes.end(), more.begin(), more.end());
  }
  ForEachTile(assignment.hidden, [&](std::int32_t x, std::int32_t y, bool hidden) {
    EXPECT_TRUE(!hidden || AnyOpaque(boxes, x, y))
        << "tile " << x << ", " << y << " is not hidden by the " << in_front << " groups in front";
  });
}

void FrameWitness::OnPicture(const FrameImage& image, const Bytes& payload, const FrameReply& reply) {
  const auto frame = frames_.find(image.frame);
  ASSERT_TRUE(frame != frames_.end()) << "a picture of a frame that was never handed out";
  SymbolicPixel expected;
  for (std::uint32_t group = 0; group < reply.groups_done; ++group) {
    const auto seen = frame->second.groups.find(group);
    ASSERT_TRUE(seen != frame->second.groups.end()) << "group " << group << " was never handed out";
    std::ranges::copy_if(seen->second, std::back_inserter(expected), [&](BoxId box) { return !frame->second.outside.contains(box); });
  }
  const Camera& camera = frame->second.setup.camera;
  EXPECT_EQ(reply.size, (ImageSize{camera.width, camera.height}));
  const SymbolicImage pixels = UnpackSymbols(payload);
  const PixelBounds bounds = FrameBounds(frame->second.setup);
  for (std::uint64_t i = 0; i < std::uint64_t(bounds.pixel_count()); ++i) {
    const auto pixel = pixels.find(i);
    const SymbolicPixel& seen = pixel == pixels.end() ? SymbolicPixel() : pixel->second;
    if (seen == expected) continue;
    const auto x = std::int32_t(i % std::uint64_t(bounds.width())), y = std::int32_t(i / std::uint64_t(bounds.width()));
    EXPECT_TRUE(UsesOcclusion(frame->second.setup) && LacksHiddenBoxesOnly(seen, expected, frame->second.left_out, x, y))
        << "frame " << image.frame << ", pixel " << i << " shows " << testing::PrintToString(seen) << ", not "
        << testing::PrintToString(expected);
    tally_.Add(Count::kHiddenPixels);
  }
  if (reply.groups_done < reply.group_count) {
    tally_.Add(Count::kPreviews);
    return;
  }
  EXPECT_EQ(reply.shares.size(), image.share_count);
  if (reply.shares.size() > 1) tally_.Add(image.attempt > 1 ? Count::kSharedPicturesRetried : Count::kSharedPictures);
  for (std::size_t far = 1; far < expected.size(); ++far) {
    for (std::size_t near = 0; near < far; ++near) {
      EXPECT_TRUE(MayComeFirst(camera, frame->second.boxes.at(expected[near]), frame->second.boxes.at(expected[far])))
          << expected[near] << " before " << expected[far] << " in " << testing::PrintToString(expected);
    }
  }
  frame->second.over = true;
  if (!faultless_) return;
  if (frame->second.all_cached) {
    std::uint64_t moved = 0;
    for (const RankReport& report : reply.statistics.reports) moved += report.voxel_bytes;
    EXPECT_EQ(moved, 0U) << "voxels that were there moved again";
    tally_.Add(Count::kCachedFrames);
  }
  fetched_.insert(frame->second.padded_boxes.begin(), frame->second.padded_boxes.end());
}

}  // namespace slabstream
