#include "client/pictures/annotations.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <optional>
#include <utility>

#include "client/pictures/picture_labels.h"
#include "client/pictures/volume_box.h"
#include "common/base/check.h"
#include "common/text/utf8.h"

namespace slabstream {
namespace {

constexpr float kHaloOpacity = 0.85F;
constexpr double kAscender = 0.93, kCapital = 0.73, kDescender = 0.24;  // of letters, in shares of their size; of DejaVu Sans

// How large everything is, in pixels.
struct Scale {
  Scale(const PictureFormat& format, ImageSize size) {
    const int shorter = std::min(size.width, size.height);
    const std::optional<double> points = format.annotations.font_size;
    if (points) {
      constexpr double kPointsAnInch = 72;
      const double wanted = *points * format.dots_per_inch.value_or(kUsualDotsPerInch) / kPointsAnInch;
      letters = int(std::lround(std::clamp(wanted, 1.0, std::max(0.25 * shorter, 1.0))));
    } else {
      letters = std::max(std::min(std::max(int(std::lround(0.032 * shorter)), 11), shorter / 9), 1);
    }
    halo = std::max(0.12 * letters, 1.5);
    margin = int(std::ceil(0.35 * letters + halo));
    line = std::max(0.11 * letters, 1.0);
  }
  int letters = 11;  // size
  int margin = 0;    // from the picture's edge
  double halo = 1;
  double line = 1;  // width
};

using AxisColors = std::array<MarkColor, 3>;  // x, y, z
constexpr AxisColors kBrightAxes = {{{1, 0.35F, 0.3F}, {0.45F, 0.9F, 0.35F}, {0.45F, 0.65F, 1}}};
constexpr AxisColors kDarkAxes = {{{0.75F, 0.1F, 0.1F}, {0, 0.45F, 0}, {0.1F, 0.25F, 0.85F}}};

// What marks are drawn with.
struct Palette {
  MarkColor letters = {1, 1, 1}, halo = {0, 0, 0};
  AxisColors axes = kBrightAxes;
};

// Relative luminance, in [0, 1] (Web Content Accessibility Guidelines 2.1).
double Luminance(const StraightColor& color) {
  const auto linear = [](float code) { return code <= 0.04045F ? double(code) / 12.92 : std::pow((double(code) + 0.055) / 1.055, 2.4); };
  return 0.2126 * linear(color.r) + 0.7152 * linear(color.g) + 0.0722 * linear(color.b);
}

Palette PaletteOn(const StraightColor& background) {
  if (background.a < 1) return {};
  // The contrasts with white and with black of these guidelines are equal here.
  constexpr double kMiddle = 0.179;
  const MarkColor ground = {background.r, background.g, background.b};
  if (Luminance(background) < kMiddle) return {{1, 1, 1}, ground, kBrightAxes};
  return {{0, 0, 0}, ground, kDarkAxes};
}

using Shape = decltype(Mark::shapes)::value_type;
using Shapes = std::vector<Shape>;

Shapes Arrow(InkPoint from, InkPoint to, const Scale& scale) {
  const double dx = to.x - from.x, dy = to.y - from.y, length = std::hypot(dx, dy);
  const double width = 1.6 * scale.line;
  if (length < width) return {Stroke{from, from, 2.4 * width}};  // towards the viewer, or away
  const double head = std::min(0.65 * scale.letters, length), half = 0.5 * head;
  const InkPoint along = {dx / length, dy / length};
  const InkPoint neck = {to.x - head * along.x, to.y - head * along.y};
  return {Stroke{from, neck, width},
          Polygon{{to, {neck.x - half * along.y, neck.y + half * along.x}, {neck.x + half * along.y, neck.y - half * along.x}}}};
}

InkPoint Between(InkPoint a, InkPoint b) { return {0.5 * (a.x + b.x), 0.5 * (a.y + b.y)}; }

InkPoint MovedRight(InkPoint point, int x) { return {point.x + x, point.y}; }
Shape MovedRight(Shape shape, int x) {
  const auto move = [x](auto& moved) {
    if constexpr (requires { moved.strokes; }) {
      for (Stroke& stroke : moved.strokes) stroke = {MovedRight(stroke.begin, x), MovedRight(stroke.end, x), stroke.width};
    } else if constexpr (requires { moved.corners; }) {
      for (InkPoint& corner : moved.corners) corner = MovedRight(corner, x);
    } else {
      moved.begin = MovedRight(moved.begin, x);
      if constexpr (requires { moved.end; }) moved.end = MovedRight(moved.end, x);
    }
  };
  std::visit(move, shape);
  return shape;
}

Ink InkOf(const Rectangle& shape, Font&) { return RectangleInk(shape.begin, shape.end); }
Ink InkOf(const Stroke& shape, Font&) { return StrokeInk(shape.begin, shape.end, shape.width); }
Ink InkOf(const Polygon& shape, Font&) { return PolygonInk(shape.corners); }
Ink InkOf(const ColorRows& shape, Font&) { return RectangleInk(shape.begin, shape.end); }
Ink InkOf(const Lines&, Font&) { return {}; }  // drawn row by row
Ink InkOf(const TextLine& shape, Font& font) {
  return Shifted(font.Draw(shape.text, shape.size), int(std::lround(shape.begin.x)), int(std::lround(shape.begin.y)));
}

// Where the label of each axis stands, seen from where the arrows begin: before the tip. That of an axis along the line of sight stands
// opposite to the two others, where nothing else is drawn.
std::array<InkPoint, 3> LabelPlaces(const std::array<ShownAxis, 3>& axes, double arrow, double gap) {
  std::array<InkPoint, 3> places;
  for (std::size_t i = 0; i < 3; ++i) {
    const double length = std::hypot(axes[i].x, axes[i].y);
    const InkPoint others = {axes[(i + 1) % 3].x + axes[(i + 2) % 3].x, axes[(i + 1) % 3].y + axes[(i + 2) % 3].y};
    const double sum = std::hypot(others.x, others.y);
    constexpr double kShort = 0.25;
    if (length >= kShort || sum == 0) {
      places[i] = {axes[i].x * (arrow + gap / length), axes[i].y * (arrow + gap / length)};
    } else {
      places[i] = {-others.x / sum * 1.2 * gap, -others.y / sum * 1.2 * gap};
    }
  }
  return places;
}

MarkColor ColorOf(const Rgb& color) { return {color.r, color.g, color.b}; }

// Draws the annotations of one picture, or of one of several side by side, each by one function.
class Artist {
 public:
  // `left`: of this picture, in pixels of the whole.
  Artist(Font& font, ImageSize size, int left, const PictureGeometry& geometry, const Scale& scale, const Palette& palette)
      : font_(&font), size_(size), left_(left), geometry_(geometry), scale_(scale), palette_(palette) {}

  // What others have drawn at the top and on the right, in pixels from the edges.
  void KeepClear(const Artist& whole, bool rightmost) {
    top_ = whole.top_;
    right_ = rightmost ? whole.right_ : 0;
    taken_ = whole.taken_;
  }

  void DrawTitle(const std::string& title) {
    top_ += kAscender * scale_.letters;
    PutText(title, {0.5 * size_.width, top_});
    top_ += (kDescender + 0.2) * scale_.letters;
  }

  // The letters of a patient's sides, at the middles of the picture's edges.
  void DrawSides() {
    const double half = 0.5 * kCapital * scale_.letters, x = 0.5 * size_.width, y = 0.5 * size_.height + half;
    const std::pair<Vec3, InkPoint> sides[] = {{geometry_.up, {x, top_ + 2 * half}},
                                               {-geometry_.up, {x, double(size_.height - scale_.margin)}},
                                               {-geometry_.right, {0, y}},  // PutText keeps texts inside the picture
                                               {geometry_.right, {size_.width - right_, y}}};
    for (const auto& [direction, place] : sides) {
      PutText(PatientSides(direction), place, palette_.letters, right_);
    }
  }

  void DrawAxes() {
    const double arrow = 2.0 * scale_.letters, gap = 0.7 * scale_.letters, reach = arrow + gap + 0.5 * scale_.letters;
    const InkPoint origin = {scale_.margin + reach, size_.height - scale_.margin - reach};
    const std::array<ShownAxis, 3> axes = ShownAxes(geometry_);
    const std::array<InkPoint, 3> places = LabelPlaces(axes, arrow, gap);
    for (std::size_t i = 0; i < 3; ++i) {
      const MarkColor color = palette_.axes[std::size_t(Number(axes[i].axis))];
      const InkPoint tip = {origin.x + arrow * axes[i].x, origin.y + arrow * axes[i].y};
      Put(Arrow(origin, tip, scale_), color);
      const InkPoint place = {origin.x + places[i].x, origin.y + places[i].y + 0.5 * kCapital * scale_.letters};
      PutText(std::string(axes[i].label), place, color);
    }
  }

  void DrawScaleBar() {
    const std::optional<ScaleBar> bar = ChooseScaleBar(geometry_, size_.width);
    if (!bar) return;
    const double end = size_.width - scale_.margin, begin = end - bar->pixels, thick = 2 * scale_.line, tick = 0.5 * scale_.letters;
    const double bottom = size_.height - scale_.margin, top = bottom - tick;
    Shapes shapes = {Rectangle{{begin, bottom - thick}, {end, bottom}}};
    for (const double x : {begin, end - thick}) shapes.emplace_back(Rectangle{{x, top}, {x + thick, bottom}});
    Put(std::move(shapes), palette_.letters);
    PutText(bar->label, {0.5 * (begin + end), top - 0.3 * scale_.letters});
  }

  // Between the top and what may stand at the bottom, below the caption. Several bars have their names above them and share the height; as
  // many as there is room for.
  void DrawColorBars(const std::vector<PictureKey::Bar>& bars, const std::string& caption) {
    double top = top_ + 0.5 * scale_.letters;
    const auto put_line = [&](const std::string& text, double below) {
      top += (kAscender - 0.5) * scale_.letters;
      PutText(text, {double(size_.width), top});
      top += (kDescender + below) * scale_.letters;
    };
    if (!caption.empty()) put_line(caption, 0.5);
    const double bottom = size_.height - scale_.margin - 2.5 * scale_.letters;
    if (bars.size() == 1) return DrawColorBar(bars.front(), top, bottom, TicksOf(bars.front().low(), bars.front().high()));
    const double least = 4 * scale_.letters, gap = 1.2 * scale_.letters;
    const std::size_t shown = ShownOf(bars.size(), (bottom - top) / least), parts = std::max<std::size_t>(shown, 1);
    const double part = (bottom - top - (shown < bars.size() ? 1.2 * scale_.letters : 0)) / double(parts);
    for (std::size_t i = 0; i < shown; ++i) {
      const double end = top + part - gap;
      put_line(bars[i].name, 0.8);
      DrawColorBar(bars[i], top, end, {bars[i].low(), bars[i].high()});
      top = end + gap;
    }
    if (shown < bars.size()) put_line(MoreText(bars.size() - shown), 0);
  }

  // One line each, as many as there is room for: of fields, if there are several, the colours of their values, their names and these
  // values; then the entries.
  void DrawLegend(const PictureKey& key) {
    const std::size_t fields = key.bars.size() > 1 ? key.bars.size() : 0, count = fields + key.entries.size();
    const double line = 1.35 * scale_.letters, swatch = std::round(0.8 * scale_.letters), left = scale_.margin;
    const double room = size_.height - top_ - scale_.margin - 6.5 * scale_.letters;  // above the axes
    const std::size_t shown = ShownOf(count, room / line);
    double y = top_ + 0.2 * scale_.letters;
    const auto put = [&](const std::string& text, double x) { PutTextFrom(text, {x, y + 0.85 * scale_.letters}); };
    for (std::size_t i = 0; i < shown; ++i, y += line) {
      const double width = i < fields ? 3 * swatch : swatch;
      const InkPoint begin = {left, std::round(y + 0.1 * scale_.letters)}, end = {begin.x + width, begin.y + swatch};
      Put({Frame(begin, end)}, palette_.letters);
      if (i < fields) {
        const PictureKey::Bar& bar = key.bars[i];
        const TransferFunction colors{.colors = bar.colors, .opacities = {}};
        for (double x = begin.x; x < end.x; ++x) {  // each part reaches to the end, so that no seams show
          PutPlain(Rectangle{{x, begin.y}, end}, ColorOf(colors.Color(std::lerp(bar.low(), bar.high(), (x + 0.5 - begin.x) / width))));
        }
        put(fmt::format("{}  {:.4g} to {:.4g}", bar.name, bar.low(), bar.high()), end.x + 0.4 * swatch);
      } else {
        PutPlain(Rectangle{begin, end}, ColorOf(key.entries[i - fields].color));
        put(key.entries[i - fields].name, end.x + 0.4 * swatch);
      }
    }
    if (shown < count) put(MoreText(count - shown), left);
  }

  // The box of the volume. Numbers keep clear of each other and of all that was drawn before.
  void DrawVolumeAxes(VolumeAxes which) {
    const std::optional<VolumeBox> box = VolumeBox::Of(geometry_, size_);
    if (!box) return;
    std::vector<Stroke> grid, hidden, front;
    const double width = 0.8 * scale_.line;
    for (const VolumeBox::Edge& edge : box->Edges()) AddLine(edge.hidden ? hidden : front, box->LineOf(edge, width));
    std::vector<Mark> labels;
    for (const Axis axis : kAxes) {
      if (which == VolumeAxes::kBox) break;
      const std::vector<double> ticks = LabelAxis(*box, axis, front, labels);
      if (which == VolumeAxes::kGrid) AddGrid(*box, axis, ticks, grid);
    }
    const auto put_under = [this](std::vector<Stroke> lines, float contrast) {
      const MarkColor &on = palette_.letters, &off = palette_.halo;
      const MarkColor color = {std::lerp(off.red, on.red, contrast), std::lerp(off.green, on.green, contrast),
                               std::lerp(off.blue, on.blue, contrast)};
      marks_.push_back({.shapes = {Lines{std::move(lines)}}, .color = color, .halo_color = {}, .under = true});
    };
    put_under(std::move(grid), 0.3F);
    put_under(std::move(hidden), 0.5F);
    Put({Lines{std::move(front)}}, palette_.letters);
    marks_.back().halo *= 0.5;
    std::ranges::move(labels, std::back_inserter(marks_));
  }

  std::vector<Mark> TakeMarks() { return std::move(marks_); }

 private:
  // How many of `count` things are shown where there is room for `most`, the last of which may have to say how many more there are.
  static std::size_t ShownOf(std::size_t count, double most) {
    const auto places = std::size_t(std::max(most, 1.0));
    return count <= places ? count : places - 1;
  }
  static std::string MoreText(std::size_t count) { return fmt::format("and {} more", count); }

  // Values upwards, with ticks to the left of the bar.
  void DrawColorBar(const PictureKey::Bar& bar, double top, double bottom, const std::vector<double>& ticks) {
    const double width = std::round(0.8 * scale_.letters), right = size_.width - scale_.margin, left = right - width,
                 tick = 0.3 * scale_.letters;
    const int rows = int(bottom - top);
    if (rows < 1) return;
    const TransferFunction colors{.colors = bar.colors, .opacities = {}};
    const double first = std::floor(top);
    ColorRows shown{{left, first}, {right, first + rows}, {}};
    for (int row = 0; row < rows; ++row) {
      shown.colors.push_back(ColorOf(colors.Color(std::lerp(bar.high(), bar.low(), (row + 0.5) / rows))));
    }
    Shapes lines = {Frame(shown.begin, shown.end)};
    int widest = 0;
    for (const double value : ticks) {
      const double y = first + rows * (bar.high() - value) / (bar.high() - bar.low());
      lines.emplace_back(Rectangle{{left - tick, y - 0.5 * scale_.line}, {left, y + 0.5 * scale_.line}});
      const std::string text = fmt::format("{:.6g}", value);
      const int text_width = font_->Width(text, scale_.letters);
      widest = std::max(widest, text_width);
      const double x = left - 1.5 * tick - 0.5 * text_width;
      PutText(text, {x, y + 0.5 * kCapital * scale_.letters});
    }
    Put(std::move(lines), palette_.letters);
    PutPlain(std::move(shown), {});
    right_ = std::max(right_, scale_.margin + width + 2 * tick + widest);
  }

  void AddLine(std::vector<Stroke>& lines, const Stroke& line) const {
    const int beyond = int(line.width + 2 * scale_.halo) + 1;
    if (const auto shown = Clipped(line, {-beyond, -beyond, size_.width + beyond, size_.height + beyond})) lines.push_back(*shown);
  }

  // Lines at these places of an axis, across the faces that do not face the viewer.
  void AddGrid(const VolumeBox& box, Axis axis, const std::vector<double>& places, std::vector<Stroke>& grid) const {
    for (const Axis across : kAxes) {
      if (across == axis) continue;
      const Axis normal = Axis(3 - Number(axis) - Number(across));
      for (const bool far : {false, true}) {
        if (box.Faces(normal, far)) continue;
        VolumeBox::Edge line{.axis = across};
        line.begin[normal] = far ? 1 : 0;
        for (const double place : places) {
          line.begin[axis] = place;
          AddLine(grid, box.LineOf(line, std::max(0.5 * scale_.line, 0.7)));
        }
      }
    }
  }

  // Ticks and numbers along one edge, as many as have room, and its name. Returns the places of the ticks on the axis, in [0, 1].
  std::vector<double> LabelAxis(const VolumeBox& box, Axis axis, std::vector<Stroke>& lines, std::vector<Mark>& labels) {
    const std::optional<VolumeBox::Edge> edge = box.LabelledEdge(axis);
    if (!edge) return {};
    const auto [begin, end, width] = box.LineOf(*edge, 0.8 * scale_.line);
    const double length = std::hypot(end.x - begin.x, end.y - begin.y), em = scale_.letters;
    if (!(length > 3 * em)) return {};
    const InkPoint along = {(end.x - begin.x) / length, (end.y - begin.y) / length}, middle = box.At({0.5, 0.5, 0.5});
    const bool left = (middle.x - begin.x) * along.y - (middle.y - begin.y) * along.x > 0;  // of the edge lies the box
    const InkPoint out = left ? InkPoint{-along.y, along.x} : InkPoint{along.y, -along.x};
    const auto [first, last] = box.ValuesOf(axis);
    const double tick = 0.4 * em, gap = 0.3 * em;

    // A text beyond a point, this far away in this direction.
    const auto text_beyond = [&](const std::string& text, InkPoint at, InkPoint direction, double distance) {
      TextLine line{.text = text, .size = scale_.letters, .begin = {}, .width = font_->Width(text, scale_.letters)};
      const double half_width = 0.5 * line.width, half_height = 0.5 * kCapital * em;
      distance += std::abs(direction.x) * half_width + std::abs(direction.y) * half_height;
      at = {std::clamp(at.x, -1e6, 1e6), std::clamp(at.y, -1e6, 1e6)};
      line.begin = {std::round(at.x + distance * direction.x - half_width), std::round(at.y + distance * direction.y + half_height)};
      return line;
    };
    const auto point_of = [&](double value) {
      Vec3 place = edge->begin;
      place[axis] = (value - first) / (last - first);
      return box.At(place);
    };
    std::vector<double> values;
    std::vector<TextLine> numbers;
    for (int most = 8; most >= 3; --most) {
      values = TicksOf(first, last, most);
      numbers.clear();
      bool apart = true;
      for (const double value : values) {
        numbers.push_back(text_beyond(fmt::format("{:.10g}", value), point_of(value), out, tick + gap));
        apart = apart && (numbers.size() < 2 || Intersection(AreaOf(numbers.end()[-2], 0.6 * em), AreaOf(numbers.back(), 0)).empty());
      }
      if (apart) break;
    }
    std::vector<double> places;
    double widest = 0;
    for (std::size_t i = 0; i < values.size(); ++i) {
      places.push_back((values[i] - first) / (last - first));
      const InkPoint at = point_of(values[i]);
      AddLine(lines, {at, {at.x + tick * out.x, at.y + tick * out.y}, width});
      if (!PutIfFree(numbers[i], lines, labels)) continue;
      widest = std::max(widest, std::abs(out.x) * numbers[i].width + std::abs(out.y) * kCapital * em);
    }
    // The name stands beyond the numbers, or between two of them, or at an end; without its unit if there is room for no more.
    const auto put_name = [&](const std::string& name) {
      const auto put = [&](InkPoint at, InkPoint direction, double distance) {
        return PutIfFree(text_beyond(name, at, direction, distance), lines, labels);
      };
      if (put(Between(begin, end), out, tick + gap + widest + 0.6 * em)) return true;
      for (std::size_t i = values.size(); i-- > 1;) {
        if (put(Between(point_of(values[i - 1]), point_of(values[i])), out, tick + gap)) return true;
      }
      const double diagonal = std::sqrt(0.5);
      return put(end, {diagonal * (out.x + along.x), diagonal * (out.y + along.y)}, gap) || put(end, along, gap) ||
             put(begin, {diagonal * (out.x - along.x), diagonal * (out.y - along.y)}, gap);
    };
    const std::string name = box.NameOf(axis);
    const bool with_unit = geometry_.unit != LengthUnit::kFile && put_name(fmt::format("{} ({})", name, PluralOf(geometry_.unit)));
    if (!with_unit) put_name(name);
    return places;
  }

  // Where a text lies, with so many pixels on every side.
  static PixelBounds AreaOf(const TextLine& text, double margin) {
    return {int(text.begin.x - margin), int(text.begin.y - kCapital * text.size - margin), int(text.begin.x + text.width + margin),
            int(text.begin.y + kDescender * text.size + margin)};
  }

  // If it lies within the picture and beside all other texts and the lines.
  bool PutIfFree(const TextLine& text, const std::vector<Stroke>& lines, std::vector<Mark>& labels) {
    const PixelBounds area = AreaOf(text, 0.2 * scale_.letters);
    if (!PixelBounds{0, 0, size_.width, size_.height}.Contains(area)) return false;
    for (const PixelBounds& taken : taken_) {
      if (!Intersection(area, taken).empty()) return false;
    }
    for (const Stroke& line : lines) {
      if (Clipped(line, AreaOf(text, 0))) return false;
    }
    taken_.push_back(AreaOf(text, 0));
    labels.push_back({.shapes = {text}, .color = palette_.letters, .halo = scale_.halo, .halo_color = palette_.halo});
    return true;
  }

  // The shapes on their halo.
  void Put(Shapes shapes, MarkColor color) {
    for (Shape& shape : shapes) {
      if (const auto* text = std::get_if<TextLine>(&shape)) taken_.push_back(AreaOf(*text, 0));
      shape = MovedRight(std::move(shape), left_);
    }
    marks_.push_back({.shapes = std::move(shapes), .color = color, .halo = scale_.halo, .halo_color = palette_.halo});
  }
  void PutPlain(Shape shape, MarkColor color) {
    marks_.push_back({.shapes = {MovedRight(std::move(shape), left_)}, .color = color, .halo_color = {}});
  }
  // A thin line round something, without which it would not show where it has the colour of the background.
  Rectangle Frame(InkPoint begin, InkPoint end) const {
    const double line = std::round(std::max(0.5 * scale_.line, 1.0));
    return {{begin.x - line, begin.y - line}, {end.x + line, end.y + line}};
  }

  // The text, with its baseline centred at `place`, but not beyond the picture's sides, and `right` pixels from the right one. One that is
  // too wide shrinks.
  void PutText(const std::string& text, InkPoint place, MarkColor color, double right = 0) {
    TextLine line = Fitted(text, size_.width - 2 * scale_.margin);
    const int least = scale_.margin, most = std::max(size_.width - std::max(scale_.margin, int(right)) - line.width, least);
    line.begin = {double(std::clamp(int(std::lround(place.x - 0.5 * line.width)), least, most)), std::round(place.y)};
    Put({std::move(line)}, color);
  }
  void PutText(const std::string& text, InkPoint place) { PutText(text, place, palette_.letters); }
  // Its baseline begins at `place`, and it ends before what stands on the right.
  void PutTextFrom(const std::string& text, InkPoint place) {
    TextLine line = Fitted(text, size_.width - std::max(double(scale_.margin), right_) - place.x);
    line.begin = {std::round(place.x), std::round(place.y)};
    Put({std::move(line)}, palette_.letters);
  }

  // The text with its size and width, which is at most `most` if letters can be so small.
  TextLine Fitted(const std::string& text, double most) const {
    const int room = std::max(int(most), 1);
    int letters = scale_.letters, width = font_->Width(text, letters);
    while (width > room && letters > 1) {
      letters = std::clamp(int(std::int64_t{letters} * room / width), 1, letters - 1);
      width = font_->Width(text, letters);
    }
    return {.text = text, .size = letters, .begin = {}, .width = width};
  }

  Font* font_;
  ImageSize size_;
  int left_;
  PictureGeometry geometry_;
  Scale scale_;
  Palette palette_;
  double top_ = scale_.margin;      // of the room that is left
  double right_ = 0;                // what is taken of it
  std::vector<PixelBounds> taken_;  // by texts
  std::vector<Mark> marks_;
};

}  // namespace

Status CheckTitle(std::string_view name, std::string_view title) {
  int characters = 0;
  for (std::string_view rest = title; !rest.empty(); ++characters) {
    const std::size_t bytes = Utf8CharacterBytes(rest);
    const auto lead = static_cast<unsigned char>(rest.front());
    const auto at = title.size() - rest.size();
    if (bytes == 0) return Status::InvalidArgument(fmt::format("{} is not UTF-8: byte {} is 0x{:02X}", name, at, lead));
    const bool second_set = lead == 0xC2 && static_cast<unsigned char>(rest[1]) < 0xA0;
    if (lead < 0x20 || lead == 0x7F || second_set) {
      return Status::InvalidArgument(fmt::format("{} has a control character at byte {}; it must be one line of text", name, at));
    }
    rest.remove_prefix(bytes);
  }
  if (characters <= kMaxTitleCharacters) return Status::Ok();
  return Status::InvalidArgument(fmt::format("{} has {} characters, at most {} are possible", name, characters, kMaxTitleCharacters));
}

Status CheckCanDraw(const Annotations& annotations) { return annotations.any() ? Font::Open().status() : Status::Ok(); }

Result<std::vector<Mark>> MarksOf(const PictureFormat& format, ImageSize size, std::span<const PictureGeometry> panes,
                                  const PictureKey& key) {
  CHECK(!panes.empty());
  const Annotations& annotations = format.annotations;
  std::vector<Mark> marks;
  if (!annotations.any()) return marks;
  Result<Font> font = Font::Open();
  if (!font.ok()) return font.status();
  const ImageSize pane = {size.width / int(panes.size()), size.height};
  const Scale scale(format, pane);
  const Palette palette = PaletteOn(format.background);
  const auto keep = [&marks](std::vector<Mark> more) { std::ranges::move(more, std::back_inserter(marks)); };

  Artist whole(*font, size, 0, panes.front(), scale, palette);
  if (!annotations.title.empty()) whole.DrawTitle(annotations.title);
  if (annotations.color_bar && !key.bars.empty()) whole.DrawColorBars(key.bars, *annotations.color_bar);
  if (annotations.legend) whole.DrawLegend(key);
  keep(whole.TakeMarks());

  for (std::size_t i = 0; i < panes.size(); ++i) {
    const PictureGeometry& geometry = panes[i];
    Artist artist(*font, pane, int(i) * pane.width, geometry, scale, palette);
    artist.KeepClear(whole, i + 1 == panes.size());
    const bool sides = annotations.orientation_marker && geometry.world == World::kPatient;
    if (sides) artist.DrawSides();
    if (annotations.orientation_marker && !(sides && annotations.sides_only)) artist.DrawAxes();
    if (annotations.scale_bar) artist.DrawScaleBar();
    keep(artist.TakeMarks());
    if (annotations.axes == VolumeAxes::kOff) continue;
    artist.DrawVolumeAxes(annotations.axes);  // below all others
    std::vector<Mark> others = std::exchange(marks, artist.TakeMarks());
    keep(std::move(others));
  }
  return marks;
}

Result<AnnotationLayers> AnnotationLayers::Draw(std::span<const Mark> marks) {
  AnnotationLayers drawn;
  if (marks.empty()) return drawn;
  Result<Font> font = Font::Open();
  if (!font.ok()) return font.status();
  for (const Mark& mark : marks) {
    if (const auto* lines = mark.shapes.empty() ? nullptr : std::get_if<Lines>(&mark.shapes.front())) {
      std::vector<Stroke> grown = lines->strokes;
      for (Stroke& stroke : grown) stroke.width += 2 * mark.halo;
      if (mark.halo > 0) drawn.layers_.push_back({{}, std::move(grown), {mark.halo_color}, kHaloOpacity});
      drawn.layers_.push_back({{}, lines->strokes, {mark.color}, 1});
      continue;
    }
    std::optional<Ink> ink;
    std::vector<MarkColor> colors = {mark.color};
    for (const Shape& shape : mark.shapes) {
      Ink more = std::visit([&font](const auto& s) { return InkOf(s, *font); }, shape);
      ink = ink ? Union(*ink, more) : std::move(more);
      if (const auto* rows = std::get_if<ColorRows>(&shape)) colors = rows->colors;
    }
    if (!ink) continue;
    if (mark.halo > 0) drawn.layers_.push_back({Grown(*ink, mark.halo), {}, {mark.halo_color}, kHaloOpacity});
    drawn.layers_.push_back({*std::move(ink), {}, std::move(colors), 1});
  }
  return drawn;
}

void AnnotationLayers::PutOver(int y, std::span<float> rgba) const {
  const auto width = std::int32_t(rgba.size() / 4);
  std::vector<float> of_strokes;
  for (const ColoredInk& layer : layers_) {
    PixelBounds b = layer.ink.bounds;
    if (!layer.strokes.empty()) {
      b = {0, y, width, y + 1};
      of_strokes.assign(std::size_t(width), 0);
      for (const Stroke& stroke : layer.strokes) CoverRow(stroke, y, of_strokes);
    }
    if (y < b.y_begin || y >= b.y_end) continue;
    const auto row = std::size_t(y - b.y_begin);
    const float* coverage = layer.strokes.empty() ? &layer.ink.coverage[row * std::size_t(b.width())] : of_strokes.data();
    const MarkColor color = layer.colors[layer.colors.size() == 1 ? 0 : row];
    for (std::int32_t x = std::max(b.x_begin, 0); x < std::min(b.x_end, width); ++x) {
      const float alpha = layer.opacity * coverage[x - b.x_begin];
      if (alpha == 0) continue;
      const float front[4] = {color.red, color.green, color.blue, 1};
      float* out = &rgba[4 * std::size_t(x)];
      for (int c = 0; c < 4; ++c) out[c] = alpha == 1 ? front[c] : out[c] + alpha * (front[c] - out[c]);  // exact on the same colour, too
    }
  }
}

}  // namespace slabstream
