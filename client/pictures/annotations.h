// Annotations: what is drawn onto a finished picture by whoever writes its file. They lie over the picture and its background, and change
// no pixel beside them. Of a volume's box, what lies behind the volume is drawn below the picture, so it shows where the picture lets
// something through.
//
//   top centre     the title; a patient's side below it
//   top left       the legend, below the title
//   left, right    a patient's sides; colour bars on the right, one below the other
//   bottom         the axes of the world on the left, a patient's side in the middle, the scale bar on the right
//
// Where several pictures stand side by side (slices), each has sides, axes and a scale bar of its own.
//
// Letters are as high as Annotations::font_size says, or else about 1/31 of the picture's shorter side, but not below 11 pixels unless the
// picture is tiny. They are black or white, whichever is easier to read on the background. A halo of the background's own colour surrounds
// them, which shows where the picture lies behind them and nowhere else. On a background that lets something through, which may have any
// colour, they are white with a dark halo.
#pragma once

#include <span>
#include <string_view>
#include <vector>

#include "client/pictures/ink.h"
#include "client/pictures/mark.h"
#include "client/pictures/picture_format.h"
#include "common/base/status.h"
#include "common/classification/picture_key.h"
#include "common/view/picture_geometry.h"

namespace slabstream {

inline constexpr int kMaxTitleCharacters = 120;

// One line of UTF-8 without control characters, at most kMaxTitleCharacters. InvalidArgument: what it is instead, after `name`.
Status CheckTitle(std::string_view name, std::string_view title);
// Whether the font of annotations opens: for a message before the work begins. Its errors are those of Font::Open.
Status CheckCanDraw(const Annotations& annotations);

// What is drawn onto a picture of this format, the last one on top, first those below the picture. Title and caption have passed
// CheckTitle. `panes`: of the pictures side by side, of equal widths, at least one. Errors as Font::Open.
Result<std::vector<Mark>> MarksOf(const PictureFormat& format, ImageSize size, std::span<const PictureGeometry> panes,
                                  const PictureKey& key = {});

struct ColoredInk {
  Ink ink;
  std::vector<Stroke> strokes;    // of Lines, instead of the ink
  std::vector<MarkColor> colors;  // one, or one for each row of the ink
  float opacity = 1;
};

// The annotations of one picture, drawn. Takes memory for the pixels that they touch.
class AnnotationLayers {
 public:
  // Errors as Font::Open.
  static Result<AnnotationLayers> Draw(std::span<const Mark> marks);

  // Puts row y of the annotations over that of the picture: premultiplied RGBA.
  void PutOver(int y, std::span<float> rgba) const;
  bool empty() const { return layers_.empty(); }

 private:
  std::vector<ColoredInk> layers_;  // the last one on top
};

}  // namespace slabstream
