// CameraPath: a view that moves through cameras at given times.
//
// Between neighbours, target, logarithm of the zoom, logarithm of the distance and field of view follow cubic Hermite curves with the
// tangents of Catmull and Rom (1974, "A class of local interpolating splines"), here for times that need not be evenly spaced: a tangent
// is the slope of the parabola through a point and its two neighbours. The direction follows the same curve among rotations: the
// cumulative form of Kim, Kim and Shin (1995, "A general construction scheme for unit quaternion curves with simple high order
// derivatives", equation 4.1). So the movement has no jumps of its speed at a camera, and turns by the shortest rotation between two.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "common/base/status.h"
#include "common/view/camera.h"

namespace slabstream {

// w + x i + y j + z k, a unit quaternion: a rotation.
using Rotation = std::array<double, 4>;

struct PathCamera {
  double seconds = 0;
  ViewParameters view;
  friend bool operator==(const PathCamera&, const PathCamera&) = default;
};

inline constexpr std::size_t kMinPathCameras = 2, kMaxPathCameras = 1000;

class CameraPath {
 public:
  // Views as ChooseView makes them. InvalidArgument, one line that names the camera, counted from 1: there are not kMinPathCameras to
  // kMaxPathCameras of them, times do not rise, or cameras do not say the same things, so that there is nothing between them.
  static Result<CameraPath> Make(std::span<const PathCamera> cameras);

  double begin_seconds() const { return knots_.front().seconds; }
  double end_seconds() const { return knots_.back().seconds; }
  // At the time of a camera: its view. Before the first camera and after the last one: theirs.
  ViewParameters At(double seconds) const;

 private:
  static constexpr int kNumbers = 6;  // target x, y, z; logarithms of zoom and distance; fov
  struct Knot {
    double seconds = 0;
    ViewParameters view;
    std::array<double, kNumbers> numbers{}, slopes{};
    Rotation rotation{};
    Vec3 spin = {};  // angular velocity in the rotated frame
  };
  explicit CameraPath(std::vector<Knot> knots);

  std::vector<Knot> knots_;
};

}  // namespace slabstream
