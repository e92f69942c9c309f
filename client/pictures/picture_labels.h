// What annotations of a picture say: the scale bar's length, the letters of a patient's sides, where the world's axes point, and the ticks
// of a colour bar. Pure; who draws them is another matter (client/pictures/annotations.h).
#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/view/picture_geometry.h"

namespace slabstream {

// A length in the world and its length in the picture, at the target's depth.
struct ScaleBar {
  double length = 0;  // 1, 2 or 5 times a power of ten
  double pixels = 0;
  std::string label;  // "50 mm"; of perspective pictures "50 mm at target"
};

// As near as possible to a fifth of the picture's width, by ratio: between 0.63 and 1.59 fifths. None: no such number can be stated.
std::optional<ScaleBar> ChooseScaleBar(const PictureGeometry& geometry, int width);

// The letters of a patient's sides that `direction` (of the world, unit) points to: R or L, A or P, S or I, the one that it is nearest to
// first. A letter is left out if the direction is within 10 degrees of a right angle to it: "A", "AR", "SLP".
std::string PatientSides(const Vec3& direction);

// An axis of the world, as the picture shows it.
struct ShownAxis {
  Axis axis = Axis::kX;
  std::string_view label;  // "x"; of patients the side that it points to: "R", "A", "S"
  double x = 0, y = 0;     // pixels to the right and downwards of an arrow that is 1 pixel long in the world
  double depth = 0;        // how far its tip lies away from the viewer, in [-1, 1]
};

// Farthest tip first, which is the order to draw them in.
std::array<ShownAxis, 3> ShownAxes(const PictureGeometry& geometry);

// Values for ticks: multiples of 1, 2 or 5 times a power of ten in [low, high], as many as possible up to `most`, at least 3. low < high,
// both finite. `most`: [3, 8].
std::vector<double> TicksOf(double low, double high, int most = 7);

}  // namespace slabstream
