// Turntables: frames that are spread evenly over full turns about the volume's z axis.
#pragma once

#include <cmath>

namespace slabstream {

inline constexpr int kMaxTurntableFrames = 100000;
inline constexpr int kMaxTurns = 1000;
inline constexpr char kPathHelp[] = "Move through the cameras of a JSON list instead of turning: docs/movies.md";
inline constexpr char kTurnsHelp[] = "Number of full turns; 0: the view is fixed";
inline constexpr char kFramesPerSecondHelp[] = "Frames per second of a movie";
inline constexpr char kTimesValue[] = "T|FIRST:LAST[:STEP]";
inline constexpr char kTimesHelp[] =
    "Which times are shown: those from FIRST to LAST, or each STEP-th of them, counted from 0; or one, as for `slabstream render`";

// The azimuth of the frame with this index in [0, frames), in degrees. It stays within one turn, so that a start near
// the limit of angles stays valid.
inline double TurntableAzimuth(double begin_degrees, int turns, int index, int frames) {
  return std::fmod(begin_degrees + 360.0 * turns * index / frames, 360.0);
}

}  // namespace slabstream
