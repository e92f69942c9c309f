// Annotations: what is drawn onto a finished picture by whoever writes its file. They lie over the picture and its background, and change
// no pixel beside them.
//
//   top centre     the title; a patient's side below it
//   top left       the legend, below the title
//   left, right    a patient's sides; the colour bar on the right
//   bottom         the axes of the world on the left, a patient's side in the middle, the scale bar on the right
//
// Where several pictures stand side by side (slices), each has sides, axes and a scale bar of its own.
//
// Letters are about 1/31 of the picture's shorter side high, but not below 11 pixels unless the picture is tiny. All have a dark halo, so
// that they can be read on any background.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "client/image_io/ink.h"
#include "client/image_io/picture_key.h"
#include "common/base/status.h"
#include "common/view/picture_geometry.h"

namespace slabstream {

inline constexpr int kMaxTitleCharacters = 120;

struct Annotations {
  bool scale_bar = false;
  bool orientation_marker = false;  // the axes of the world; of patients also the letters of the sides
  bool sides_only = false;          // of patients the letters without the axes, as is usual in slices
  std::string title;                // empty: none
  // What the picture's key says (PictureKey); a key that has nothing of it leaves them out.
  std::optional<std::string> color_bar;  // its caption, such as a unit; "": none
  bool legend = false;

  bool any() const { return scale_bar || orientation_marker || !title.empty() || needs_key(); }
  bool needs_key() const { return color_bar || legend; }
  friend bool operator==(const Annotations&, const Annotations&) = default;
};

// One line of UTF-8 without control characters, at most kMaxTitleCharacters. InvalidArgument: what it is instead, after `name`.
Status CheckTitle(std::string_view name, std::string_view title);
// For a message before the work begins. NotFound: the font (AnnotationFont).
Status CheckCanDraw(const Annotations& annotations);

struct ColoredInk {
  Ink ink;
  float red = 0, green = 0, blue = 0, opacity = 1;  // straight
};

// The annotations of one picture, drawn. Takes memory for the pixels that they touch.
class AnnotationLayers {
 public:
  // Title and caption have passed CheckTitle. `panes`: of the pictures side by side, of equal widths, at least one. Errors as TextInk.
  static Result<AnnotationLayers> Draw(const Annotations& annotations, ImageSize size, std::span<const PictureGeometry> panes,
                                       const PictureKey& key = {});

  // Puts row y of the annotations over that of the picture: premultiplied RGBA.
  void PutOver(int y, std::span<float> rgba) const;
  bool empty() const { return layers_.empty(); }

 private:
  std::vector<ColoredInk> layers_;  // the last one on top
};

}  // namespace slabstream
