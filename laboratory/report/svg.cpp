#include "laboratory/report/svg.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>

#include "laboratory/report/text.h"

namespace slabstream {
namespace {

// By colour, round the point where a path begins: circle, square, triangle, diamond, triangle upside down, pentagon, flag, hourglass.
constexpr std::array<std::string_view, kPaletteSize> kMarkers = {"m-3.7 0a3.7 3.7 0 1 0 7.4 0a3.7 3.7 0 1 0 -7.4 0z",
                                                                 "m-3.5 -3.5h7v7h-7z",
                                                                 "m0 -4.6l4.4 7.6h-8.8z",
                                                                 "m0 -4.8l4.8 4.8l-4.8 4.8l-4.8 -4.8z",
                                                                 "m0 4.6l4.4 -7.6h-8.8z",
                                                                 "m0 -4.3l4.1 3l-1.6 4.8h-5l-1.6 -4.8z",
                                                                 "m-3.6 -4.4l7.4 4.4l-7.4 4.4z",
                                                                 "m-4 -4h8l-8 8h8z"};
constexpr std::string_view kCross = "m-3.6 -3.6l7.2 7.2m0 -7.2l-7.2 7.2";

// Okabe and Ito's colours, darkened if they would be faint on white; and lightened, for dark pages.
constexpr std::array<std::string_view, kPaletteSize> kLight = {"#0072b2", "#d55e00", "#009e73", "#aa4499",
                                                               "#c08a00", "#3aa0d8", "#6b6b6b", "#882255"};
constexpr std::array<std::string_view, kPaletteSize> kDark = {"#4db2ff", "#ff8a3d", "#2fd0a5", "#e08fd0",
                                                              "#f2c14e", "#8fd0f5", "#b5b5b5", "#e07a9f"};

std::string ColorRules(const std::array<std::string_view, kPaletteSize>& colors, std::string_view plain) {
  std::string rules = fmt::format(".ss .c{0}{{stroke:{1};fill:{1}}}", kPaletteSize, plain);
  for (int i = 0; i < kPaletteSize; ++i) {
    rules += fmt::format(".ss .c{0}{{stroke:{1};fill:{1}}}", i, colors[std::size_t(i)]);
  }
  return rules;
}

const std::string& StyleSheet() {
  static const std::string sheet =
      "<style>"
      ".ss text{font:12px system-ui,'DejaVu Sans',sans-serif;fill:#222}.ss text.title{font-size:14px;font-weight:600}"
      ".ss text.small{font-size:10.5px;fill:#555}"
      ".ss .axis{stroke:#555;stroke-width:1;fill:none}.ss .grid{stroke:#ddd;stroke-width:1;fill:none}"
      ".ss .back{fill:#f4f4f4;stroke:none}.ss .outline{fill:none;stroke:#999;stroke-width:.6}"
      ".ss .curve{fill:none;stroke-width:1.8;stroke-linejoin:round}.ss .whisker{fill:none;stroke-width:1.1;opacity:.75}"
      ".ss .curve.simulated{stroke-dasharray:6 3.5}.ss .curve.paper{stroke-dasharray:.1 4.2;stroke-linecap:round;stroke-width:2.2}"
      ".ss .open{fill:none;stroke-width:1.5}.ss .reference{fill:none;stroke:#777;stroke-width:1}.ss text.mark{font-size:9px;fill:#fff}"
      ".ss .bar{stroke-width:1}.ss .bar.simulated{fill-opacity:.5;stroke-dasharray:4 2}"
      ".ss .bar.paper{fill-opacity:.15;stroke-dasharray:1.2 2.2}" +
      ColorRules(kLight, "#555") +
      // After the colours, so that unfilled shapes stay open.
      ".ss .curve,.ss .open,.ss .whisker{fill:none}"
      "@media (prefers-color-scheme:dark){.ss text{fill:#e6e6e6}.ss text.small{fill:#b0b0b0}.ss .axis{stroke:#aaa}.ss .grid{stroke:#3a3a3a}"
      ".ss text.mark{fill:#000}.ss .back{fill:#262626}.ss .outline{stroke:#777}" +
      ColorRules(kDark, "#bbb") + ".ss .curve,.ss .open,.ss .whisker{fill:none}}</style>";
  return sheet;
}

std::string_view AnchorName(TextAnchor anchor) {
  constexpr std::array<std::string_view, 3> kNames = {"start", "middle", "end"};
  return kNames[std::size_t(anchor)];
}

// The number of the class; that of texts comes after the palette.
int ColorClass(int color) { return color == kPlainColor ? kPaletteSize : color % kPaletteSize; }

}  // namespace

SvgCanvas::SvgCanvas(double width, double height, std::string_view title) {
  text_ = fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" class=\"ss\" role=\"img\" width=\"{0:.0f}\" height=\"{1:.0f}\" viewBox=\"0 0 {0:.0f} "
      "{1:.0f}\">"
      "{2}<title>{3}</title>\n",
      width, height, StyleSheet(), Escape(title));
}

void SvgCanvas::Hint(std::string_view hint, std::string_view element) {
  text_ += hint.empty() ? fmt::format("<{}/>\n", element)
                        : fmt::format("<{}><title>{}</title></{}>\n", element, Escape(hint), element.substr(0, element.find(' ')));
}

void SvgCanvas::Line(SvgPoint from, SvgPoint to, std::string_view style) {
  text_ += fmt::format("<line class=\"{}\" x1=\"{:.1f}\" y1=\"{:.1f}\" x2=\"{:.1f}\" y2=\"{:.1f}\"/>\n", style, from.x, from.y, to.x, to.y);
}

void SvgCanvas::Text(SvgPoint at, std::string_view text, TextAnchor anchor, std::string_view style) {
  text_ += fmt::format("<text class=\"{}\" x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"{}\">{}</text>\n", style, at.x, at.y, AnchorName(anchor),
                       Escape(text));
}

void SvgCanvas::VerticalText(SvgPoint at, std::string_view text, TextAnchor anchor, std::string_view style) {
  text_ += fmt::format("<text class=\"{0}\" text-anchor=\"{1}\" transform=\"translate({2:.1f} {3:.1f}) rotate(-90)\">{4}</text>\n", style,
                       AnchorName(anchor), at.x, at.y, Escape(text));
}

void SvgCanvas::Polyline(const std::vector<SvgPoint>& points, int color, std::optional<Origin> origin) {
  if (points.size() < 2) return;
  text_ += fmt::format("<polyline class=\"{}\" points=\"",
                       origin ? fmt::format("c{} curve {}", ColorClass(color), ToString(*origin)) : "reference");
  for (const SvgPoint& point : points) fmt::format_to(std::back_inserter(text_), "{:.1f},{:.1f} ", point.x, point.y);
  text_.back() = '"';
  text_ += "/>\n";
}

void SvgCanvas::Marker(SvgPoint at, int color, Origin origin, std::string_view hint) {
  const int c = ColorClass(color);
  Hint(hint, fmt::format("path class=\"c{}{}\" d=\"M{:.1f} {:.1f}{}\"", c, origin == Origin::kMeasured ? "" : " open", at.x, at.y,
                         origin == Origin::kPaper ? kCross : kMarkers[std::size_t(c % kPaletteSize)]));
}

void SvgCanvas::Spread(double x, double y_low, double y_high, int color) {
  constexpr double kCap = 3;
  text_ += fmt::format("<path class=\"c{0} whisker\" d=\"M{1:.1f} {3:.1f}h{5}m-{6} 0V{4:.1f}m-{6} 0h{5}\"/>\n", ColorClass(color), x - kCap,
                       x, y_low, y_high, 2 * kCap, kCap);
}

void SvgCanvas::Bar(double x, double y, double width, double height, int color, Origin origin, std::string_view hint) {
  Hint(hint, fmt::format("rect class=\"c{} bar {}\" x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.2f}\" height=\"{:.2f}\"", ColorClass(color),
                         ToString(origin), x, y, width, height));
}

void SvgCanvas::Rect(double x, double y, double width, double height, std::string_view style, std::string_view hint) {
  Hint(hint, fmt::format("rect class=\"{}\" x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{:.1f}\"", style, x, y, width, height));
}

void SvgCanvas::Cell(double x, double y, double width, double height, double share, std::string_view hint) {
  Hint(hint, fmt::format("rect shape-rendering=\"crispEdges\" fill=\"{}\" x=\"{:.2f}\" y=\"{:.2f}\" width=\"{:.2f}\" height=\"{:.2f}\"",
                         HeatColor(share), x, y, width, height));
}

std::string SvgCanvas::Finish() && {
  text_ += "</svg>\n";
  return std::move(text_);
}

std::string HeatColor(double share) {
  struct Rgb {
    double r, g, b;
  };
  constexpr std::array<Rgb, 5> kStops = {{{0, 34, 78}, {63, 77, 107}, {124, 123, 120}, {188, 175, 111}, {254, 232, 56}}};
  const double place = std::clamp(std::isfinite(share) ? share : 0, 0.0, 1.0) * double(kStops.size() - 1);
  const std::size_t below = std::min(std::size_t(place), kStops.size() - 2);
  const double t = place - double(below);
  const auto mix = [t](double a, double b) { return int(std::lround(a + t * (b - a))); };
  const Rgb &a = kStops[below], &b = kStops[below + 1];
  return fmt::format("#{:02x}{:02x}{:02x}", mix(a.r, b.r), mix(a.g, b.g), mix(a.b, b.b));
}

}  // namespace slabstream
