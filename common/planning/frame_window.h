// How much of a frame sequence is under way at a time: the coordinator's rules, which the simulation follows too. The next group renders
// while one combines, across frames.
#pragma once

namespace slabstream {

inline constexpr int kGroupWindow = 2;        // unfinished groups, over all frames
inline constexpr int kMaxFramesInFlight = 2;  // frames with a plan

}  // namespace slabstream
