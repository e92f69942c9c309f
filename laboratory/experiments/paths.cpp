#include "laboratory/experiments/paths.h"

#include <algorithm>
#include <cmath>

#include "laboratory/bench/bench_cases.h"

namespace slabstream {
namespace {

constexpr double kDegrees = 2;        // a step
constexpr double kStillDegrees = 30;  // azimuth of a view that does not move
constexpr double kJumpDegrees = 90;

ViewParameters Turned(double degrees) { return {.azimuth_degrees = degrees, .elevation_degrees = kBenchElevationDegrees}; }
ViewParameters Still(int, bool) { return Turned(kStillDegrees); }
// From 1 to 4 within a path.
double Magnified(int step) { return std::pow(4, double(step) / kPathFrames); }

}  // namespace

const std::vector<Path>& Paths() {
  static const std::vector<Path> paths = {
      {"turntable", "a turn about the z axis, 2 degrees a step, orthographic", [](int step, bool) { return Turned(kDegrees * step); }},
      {"zoom", "the picture is magnified from 1 to 4, orthographic",
       [](int step, bool) {
         ViewParameters view = Still(step, false);
         view.zoom = Magnified(step);
         return view;
       }},
      {"jump", "a view that stays, but for a jump of 90 degrees in the middle",
       [](int, bool after) { return Turned(after ? kStillDegrees + kJumpDegrees : kStillDegrees); }, PathChange::kNothing, true},
      {"transfer", "one view; in the middle, the transfer function changes", Still, PathChange::kTransfer, true},
      {"slow-worker", "one view; from the middle on, one worker takes twice as long for each box", Still, PathChange::kSlowWorker, true},
      {"time-series", "one view; the volume changes every 15 frames (clusters alone, which drift)", Still, PathChange::kVolume},
      {"turn-over", "a turn about the x axis, 2 degrees a step, orthographic",
       [](int step, bool) { return ViewParameters{.elevation_degrees = kDegrees * step}; }},
      {"fly-through", "half a turn while approaching the volume, perspective",
       [](int step, bool) {
         ViewParameters view = Turned(step);
         view.projection = Projection::kPerspective;
         view.zoom = Magnified(step);
         view.fov_degrees = 20 + 40.0 * step / kPathFrames;
         return view;
       }},
  };
  return paths;
}

const Path* FindPath(std::string_view name) {
  const auto found = std::ranges::find(Paths(), name, &Path::name);
  return found == Paths().end() ? nullptr : &*found;
}

}  // namespace slabstream
