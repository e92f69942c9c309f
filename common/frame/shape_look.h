// ShapeLook: how a picture shows a shape (common/shapes/shape.h).
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "common/classification/rgb.h"

namespace slabstream {

inline constexpr std::size_t kMaxShownShapes = 64;
inline constexpr std::size_t kShapeMapColors = 256;

enum class ShapeColoring : std::uint8_t {
  kOne = 1,       // all of it has one colour
  kVertices = 2,  // each vertex has its own
  kValues = 3,    // a colour map shows the values of vertices
};

struct ShapeLook {
  ShapeColoring coloring = ShapeColoring::kOne;
  Rgb color = {1, 1, 1};         // kOne; and kValues, where there is no value
  std::vector<Rgb> map = {};     // kValues: kShapeMapColors colours, in even steps from `low` to `high`; values beyond have the outer ones
  double low = 0, high = 1;      // kValues: low < high
  double opacity = 1;            // (0, 1]; times that of vertices if these have colours and show them
  double width = 0;              // thickness of lines, diameter of points; 0: that of the shape's radii, or kStandardWidth pixels
  bool width_in_pixels = false;  // of the finished picture; else in the unit of FrameSetup
  bool unlit = false;            // colours show as they are, and nothing lies in its shadow
  friend bool operator==(const ShapeLook&, const ShapeLook&) = default;
};

inline constexpr double kStandardLineWidth = 2, kStandardPointWidth = 5;  // pixels

}  // namespace slabstream
