// Mark: one thing of the annotations of a picture, as shapes and texts, before anybody has made pixels of it. The raster formats draw marks
// into their pixels (client/pictures/annotations.h); the vector formats keep them as shapes and texts (cairo_encoder.cpp).
//
// Positions are in pixels of the picture, x to the right and y downwards; pixel (column, row) fills [column, column + 1) x [row, row + 1).
#pragma once

#include <string>
#include <variant>
#include <vector>

namespace slabstream {

struct InkPoint {
  double x = 0, y = 0;
};

struct MarkColor {
  float red = 0, green = 0, blue = 0;  // in [0, 1], without a transfer curve
};

struct Rectangle {
  InkPoint begin, end;  // begin: upper left corner
};
struct Stroke {
  InkPoint begin, end;  // equal: a disc
  double width = 1;     // the ends are round
};
struct Polygon {
  std::vector<InkPoint> corners;  // convex, clockwise as seen in the picture
};
struct TextLine {
  std::string text;  // UTF-8
  int size = 11;     // pixels from ascender to descender
  InkPoint begin;    // where the baseline begins
  int width = 0;     // pixels, as Font::Width measures it
};
// Colours from top to bottom, one for each row of pixels. Its sides lie between pixels.
struct ColorRows {
  InkPoint begin, end;
  std::vector<MarkColor> colors;
};

// Strokes that may be long.
struct Lines {
  std::vector<Stroke> strokes;
};

struct Mark {
  std::vector<std::variant<Rectangle, Stroke, Polygon, TextLine, ColorRows, Lines>> shapes;  // drawn as one; Lines stand alone
  MarkColor color;                                                                           // not of ColorRows
  double halo = 0;  // pixels round the shapes, drawn before them; 0: none
  MarkColor halo_color;
  bool under = false;  // below the picture, over its background
};

}  // namespace slabstream
