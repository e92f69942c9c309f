// Ink: the shapes and letters that annotations are drawn with, as coverage of pixels. Anti-aliased: the coverage of a pixel is the share of
// it that a shape covers, or close to that at slanted edges.
// Positions are those of marks (client/pictures/mark.h).
#pragma once

#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "client/pictures/mark.h"
#include "common/base/status.h"
#include "common/image/pixel_bounds.h"

struct FT_LibraryRec_;  // FreeType's
struct FT_FaceRec_;

namespace slabstream {

struct Ink {
  PixelBounds bounds;           // may reach beyond the picture; outside of it there is no ink
  std::vector<float> coverage;  // one for each pixel of the bounds, row by row, in [0, 1]
};

Ink RectangleInk(InkPoint begin, InkPoint end);             // begin: upper left corner
Ink StrokeInk(InkPoint begin, InkPoint end, double width);  // with round ends; begin == end: a disc
// Its coverage of row y, into that of the row's pixels, from column 0: the larger one of both. For long lines, as it takes no memory.
void CoverRow(const Stroke& stroke, int y, std::span<float> coverage);
Ink PolygonInk(std::span<const InkPoint> corners);  // convex, clockwise as seen in the picture
Ink Union(const Ink& a, const Ink& b);              // the larger coverage
Ink Grown(const Ink& ink, double radius);           // everything within `radius` pixels of it
Ink Shifted(Ink ink, int x, int y);                 // by whole pixels

// The font of annotations: the file that $SLABSTREAM_FONT names, or DejaVu Sans Bold, from beside the program or from where
// Debian has it. NotFound: there is no such file; the message says what to install.
Result<std::string> AnnotationFont();

// The font of annotations, opened. One thread. (OpenImageIO's render_text would do, but version 2.4 reads of each character of UTF-8 only
// the last byte.)
class Font {
 public:
  // NotFound: AnnotationFont. InvalidArgument: its file is none whose letters may have any size.
  static Result<Font> Open();

  // One line of UTF-8 text whose letters are `size` pixels high, from ascender to descender; its baseline begins at (0, 0). Characters
  // stand side by side, each as the font has it; those that it lacks are boxes.
  Ink Draw(std::string_view text, int size);
  int Width(std::string_view text, int size);  // of the text, in pixels

 private:
  struct Done {
    void operator()(FT_LibraryRec_* library) const;
    void operator()(FT_FaceRec_* face) const;
  };
  // Calls visit(glyph, pen) for each character that the font can draw, with the place of its origin on the baseline. Returns the place
  // after the last one.
  template <class Visit>
  int Lay(std::string_view text, int size, int flags, Visit&& visit);

  std::unique_ptr<FT_LibraryRec_, Done> library_;
  std::unique_ptr<FT_FaceRec_, Done> face_;  // goes first
};

}  // namespace slabstream
