// SvgCanvas: a drawing as one self-contained SVG text, with the few shapes of charts. Colours are classes of one style sheet that is part
// of the drawing and works for light and dark pages; no script, no font file, no link.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "laboratory/results/origin.h"

namespace slabstream {

// Colours of series and stages that colour-blind readers can tell apart (after Okabe and Ito 2008). Index modulo the count.
inline constexpr int kPaletteSize = 8, kPlainColor = -1;  // plain: the colour of texts, standing for all colours

struct SvgPoint {
  double x = 0, y = 0;
};

enum class TextAnchor { kStart, kMiddle, kEnd };

class SvgCanvas {
 public:
  // Size in pixels. Screen readers read `title`.
  SvgCanvas(double width, double height, std::string_view title);

  // `style` is a class of the style sheet: "grid", "axis".
  void Line(SvgPoint from, SvgPoint to, std::string_view style);
  void Text(SvgPoint at, std::string_view text, TextAnchor anchor = TextAnchor::kStart, std::string_view style = "label");
  // Reads from bottom to top.
  void VerticalText(SvgPoint at, std::string_view text, TextAnchor anchor = TextAnchor::kMiddle, std::string_view style = "label");

  // Series: the stroke follows the origin; no origin: a reference line.
  void Polyline(const std::vector<SvgPoint>& points, int color, std::optional<Origin> origin);
  // Each colour has its own shape, filled or open by origin; numbers from the paper are crosses. `hint`: shown on hovering.
  void Marker(SvgPoint at, int color, Origin origin, std::string_view hint = "");
  void Spread(double x, double y_low, double y_high, int color);  // a whisker
  void Bar(double x, double y, double width, double height, int color, Origin origin, std::string_view hint = "");

  void Rect(double x, double y, double width, double height, std::string_view style, std::string_view hint = "");
  void Cell(double x, double y, double width, double height, double share, std::string_view hint = "");  // share in [0, 1] of HeatColor

  std::string Finish() &&;  // ends with a newline

 private:
  void Hint(std::string_view hint, std::string_view element);
  std::string text_;
};

// "#rrggbb", from dark blue by way of grey to yellow (after cividis: Nunez, Anderton and Renslow 2018).
std::string HeatColor(double share);

}  // namespace slabstream
