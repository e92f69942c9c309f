// Ink: the shapes and letters that annotations are drawn with, as coverage of pixels. Anti-aliased: the coverage of a pixel is the share of
// it that a shape covers, or close to that at slanted edges.
// Positions are those of marks (client/picture_encoder/mark.h).
#pragma once

#include <span>
#include <string>
#include <vector>

#include "client/picture_encoder/mark.h"
#include "common/base/status.h"
#include "common/image/pixel_bounds.h"

namespace slabstream {

struct Ink {
  PixelBounds bounds;           // may reach beyond the picture; outside of it there is no ink
  std::vector<float> coverage;  // one for each pixel of the bounds, row by row, in [0, 1]
};

Ink RectangleInk(InkPoint begin, InkPoint end);             // begin: upper left corner
Ink StrokeInk(InkPoint begin, InkPoint end, double width);  // with round ends; begin == end: a disc
Ink PolygonInk(std::span<const InkPoint> corners);          // convex, clockwise as seen in the picture
Ink Union(const Ink& a, const Ink& b);                      // the larger coverage
Ink Grown(const Ink& ink, double radius);                   // everything within `radius` pixels of it
Ink Shifted(Ink ink, int x, int y);                         // by whole pixels

// The font of annotations: the file that $SLABSTREAM_FONT names, or DejaVu Sans Bold, from beside the program or from where
// Debian has it. NotFound: there is no such file; the message says what to install.
Result<std::string> AnnotationFont();

// What the text measures in pixels, before it is drawn. Errors as TextInk.
Result<int> TextWidth(const std::string& text, int size);

// One line of UTF-8 text whose letters are `size` pixels high, from ascender to descender; its baseline begins at (0, 0). Characters stand
// side by side, each as the font has it; those that it lacks are boxes. InvalidArgument: the font's file is none.
Result<Ink> TextInk(const std::string& text, int size);

}  // namespace slabstream
