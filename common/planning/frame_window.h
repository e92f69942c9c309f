// FrameWindow: how much of a frame sequence is under way at a time. The coordinator and the simulation follow this rule. The next group
// renders while others combine, across frames, and pictures are made meanwhile.
//
// Rendering a frame on p workers takes 1/p of the time of one worker; the hops of combining, the making of the picture and the messages
// around it do not get shorter. So more workers need more frames under way to be busy: as many as there are workers, since a new frame then
// still waits behind about as much work as behind two frames of two workers. The number is bounded
//   below  by 2, which one or two workers need to render while they combine;
//   above  by kMostInWindow, so that a frame asked for late does not wait behind many;
//   and by memory: a worker holds an image, which may be as large as the frame, for every unfinished group: at most kWindowBytes in
//          all, but always room for 2, and never more frames than fit the limit that workers have stated (FramesThatFit).
// Each team (common/planning/team.h) has its own window.
//
// A frame that uses occlusion masks has at most kMaskedGroups unfinished groups: the earlier a group is handed out, the less is known to be
// hidden from it.
#pragma once

#include <cstdint>

namespace slabstream {

inline constexpr int kLeastInWindow = 2, kMostInWindow = 16, kMaskedGroups = 2;
inline constexpr std::int64_t kWindowBytes = std::int64_t{256} << 20;

struct FrameWindow {
  int groups = kLeastInWindow;  // unfinished, over all frames: handed out and not accumulated
  int frames = kLeastInWindow;  // with a plan and without a picture
  friend bool operator==(const FrameWindow&, const FrameWindow&) = default;
};

// `workers` in all, in `teams` >= 1 teams; `frame_bytes` of the largest frame under way (FrameBytes), 0 if there is none. Both members lie
// in [kLeastInWindow, kMostInWindow] for each team, or are `fit` >= 1 if that is less.
FrameWindow WindowFor(std::size_t workers, std::uint32_t teams, std::int64_t frame_bytes, int fit = kMostInWindow);

}  // namespace slabstream
