#include "client/image_io/annotations.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <optional>
#include <utility>

#include "common/base/check.h"
#include "common/base/utf8.h"
#include "common/view/picture_labels.h"

namespace slabstream {
namespace {

constexpr float kHaloOpacity = 0.85F;
constexpr double kAscender = 0.93, kCapital = 0.73, kDescender = 0.24;  // of letters, in shares of their size; of DejaVu Sans

// How large everything is, in pixels.
struct Scale {
  explicit Scale(ImageSize size) {
    const int shorter = std::min(size.width, size.height);
    letters = std::max(std::min(std::max(int(std::lround(0.032 * shorter)), 11), shorter / 9), 1);
    halo = std::max(0.12 * letters, 1.5);
    margin = int(std::ceil(0.35 * letters + halo));
    line = std::max(0.11 * letters, 1.0);
  }
  int letters = 11;  // size
  int margin = 0;    // from the picture's edge
  double halo = 1;
  double line = 1;  // width
};

struct Color {
  float red, green, blue;
};
constexpr Color kWhite = {1, 1, 1};
constexpr std::array<Color, 3> kAxisColors = {{{1, 0.35F, 0.3F}, {0.45F, 0.9F, 0.35F}, {0.45F, 0.65F, 1}}};  // x, y, z

Ink Arrow(InkPoint from, InkPoint to, const Scale& scale) {
  const double dx = to.x - from.x, dy = to.y - from.y, length = std::hypot(dx, dy);
  const double width = 1.6 * scale.line;
  if (length < width) return StrokeInk(from, from, 2.4 * width);  // towards the viewer, or away
  const double head = std::min(0.65 * scale.letters, length), half = 0.5 * head;
  const InkPoint along = {dx / length, dy / length};
  const InkPoint neck = {to.x - head * along.x, to.y - head * along.y};
  const std::array<InkPoint, 3> corners = {
      to, {neck.x - half * along.y, neck.y + half * along.x}, {neck.x + half * along.y, neck.y - half * along.x}};
  return Union(StrokeInk(from, neck, width), PolygonInk(corners));
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

Color ColorOf(const Rgb& color) { return {color.r, color.g, color.b}; }

// Draws the annotations of one picture, or of one of several side by side, each by one function.
class Artist {
 public:
  // `left`: of this picture, in pixels of the whole.
  Artist(ImageSize size, int left, const PictureGeometry& geometry, const Scale& scale)
      : size_(size), left_(left), geometry_(geometry), scale_(scale) {}

  // What others have drawn at the top and on the right, in pixels from the edges.
  void KeepClear(double top, double right) {
    top_ = top;
    right_ = right;
  }
  double top() const { return top_; }
  double right() const { return right_; }

  Status DrawTitle(const std::string& title) {
    top_ += kAscender * scale_.letters;
    Status status = PutText(title, {0.5 * size_.width, top_});
    top_ += (kDescender + 0.2) * scale_.letters;
    return status;
  }

  // The letters of a patient's sides, at the middles of the picture's edges.
  Status DrawSides() {
    const double half = 0.5 * kCapital * scale_.letters, x = 0.5 * size_.width, y = 0.5 * size_.height + half;
    const std::pair<Vec3, InkPoint> sides[] = {{geometry_.up, {x, top_ + 2 * half}},
                                               {-geometry_.up, {x, double(size_.height - scale_.margin)}},
                                               {-geometry_.right, {0, y}},  // PutText keeps texts inside the picture
                                               {geometry_.right, {size_.width - right_, y}}};
    for (const auto& [direction, place] : sides) {
      if (Status status = PutText(PatientSides(direction), place, kWhite, right_); !status.ok()) return status;
    }
    return Status::Ok();
  }

  Status DrawAxes() {
    const double arrow = 2.0 * scale_.letters, gap = 0.7 * scale_.letters, reach = arrow + gap + 0.5 * scale_.letters;
    const InkPoint origin = {scale_.margin + reach, size_.height - scale_.margin - reach};
    const std::array<ShownAxis, 3> axes = ShownAxes(geometry_);
    const std::array<InkPoint, 3> places = LabelPlaces(axes, arrow, gap);
    for (std::size_t i = 0; i < 3; ++i) {
      const Color color = kAxisColors[std::size_t(Number(axes[i].axis))];
      const InkPoint tip = {origin.x + arrow * axes[i].x, origin.y + arrow * axes[i].y};
      Put(Arrow(origin, tip, scale_), color);
      const InkPoint place = {origin.x + places[i].x, origin.y + places[i].y + 0.5 * kCapital * scale_.letters};
      if (Status status = PutText(std::string(axes[i].label), place, color); !status.ok()) return status;
    }
    return Status::Ok();
  }

  Status DrawScaleBar() {
    const std::optional<ScaleBar> bar = ChooseScaleBar(geometry_, size_.width);
    if (!bar) return Status::Ok();
    const double end = size_.width - scale_.margin, begin = end - bar->pixels, thick = 2 * scale_.line, tick = 0.5 * scale_.letters;
    const double bottom = size_.height - scale_.margin, top = bottom - tick;
    Ink ink = RectangleInk({begin, bottom - thick}, {end, bottom});
    for (const double x : {begin, end - thick}) ink = Union(ink, RectangleInk({x, top}, {x + thick, bottom}));
    Put(ink, kWhite);
    return PutText(bar->label, {0.5 * (begin + end), top - 0.3 * scale_.letters});
  }

  // Between the top and what may stand at the bottom: values upwards, with ticks to the left of the bar and the caption above it.
  Status DrawColorBar(const PictureKey::Bar& bar, const std::string& caption) {
    const double width = 0.8 * scale_.letters, right = size_.width - scale_.margin, left = right - width, tick = 0.3 * scale_.letters;
    double top = top_ + 0.5 * scale_.letters;
    if (!caption.empty()) {
      top = top_ + kAscender * scale_.letters;
      if (Status status = PutText(caption, {double(size_.width), top}); !status.ok()) return status;
      top += (kDescender + 0.5) * scale_.letters;
    }
    const double bottom = size_.height - scale_.margin - 2.5 * scale_.letters;
    const int rows = int(bottom - top);
    if (rows < 1) return Status::Ok();
    const TransferFunction colors{.colors = bar.colors, .opacities = {}};
    PutHalo(RectangleInk({left, std::floor(top)}, {right, std::floor(top) + rows}));
    for (int row = 0; row < rows; ++row) {
      const double y = std::floor(top) + row, value = std::lerp(bar.high, bar.low, (row + 0.5) / rows);
      PutPlain(RectangleInk({left, y}, {right, y + 1}), ColorOf(colors.Color(value)));
    }
    int widest = 0;
    for (const double value : TicksOf(bar.low, bar.high)) {
      const double y = std::floor(top) + rows * (bar.high - value) / (bar.high - bar.low);
      Put(RectangleInk({left - tick, y - 0.5 * scale_.line}, {left, y + 0.5 * scale_.line}), kWhite);
      const std::string text = fmt::format("{:.6g}", value);
      const Result<int> text_width = TextWidth(text, scale_.letters);
      if (!text_width.ok()) return text_width.status();
      widest = std::max(widest, *text_width);
      const double x = left - 1.5 * tick - 0.5 * *text_width;
      if (Status status = PutText(text, {x, y + 0.5 * kCapital * scale_.letters}); !status.ok()) return status;
    }
    right_ = scale_.margin + width + 2 * tick + widest;
    return Status::Ok();
  }

  // One line each, as many as there is room for.
  Status DrawLegend(const std::vector<PictureKey::Entry>& entries) {
    const double line = 1.35 * scale_.letters, swatch = 0.8 * scale_.letters, left = scale_.margin;
    const double room = size_.height - top_ - scale_.margin - 6.5 * scale_.letters;  // above the axes
    const std::size_t lines = std::max(std::size_t(std::max(room / line, 0.0)), std::size_t{1});
    const std::size_t shown = entries.size() <= lines ? entries.size() : lines - 1;
    double y = top_ + 0.2 * scale_.letters;
    const auto put = [&](const std::string& text, double x) { return PutTextFrom(text, {x, y + 0.85 * scale_.letters}); };
    for (std::size_t i = 0; i < shown; ++i, y += line) {
      Put(RectangleInk({left, y + 0.1 * scale_.letters}, {left + swatch, y + 0.1 * scale_.letters + swatch}), ColorOf(entries[i].color));
      if (Status status = put(entries[i].name, left + 1.4 * swatch); !status.ok()) return status;
    }
    return shown < entries.size() ? put(fmt::format("and {} more", entries.size() - shown), left) : Status::Ok();
  }

  std::vector<ColoredInk> TakeLayers() { return std::move(layers_); }

 private:
  // The ink on its halo.
  void Put(const Ink& ink, Color color) {
    PutHalo(ink);
    PutPlain(ink, color);
  }
  void PutHalo(const Ink& ink) { layers_.push_back({Shifted(Grown(ink, scale_.halo), left_, 0), 0, 0, 0, kHaloOpacity}); }
  void PutPlain(const Ink& ink, Color color) { layers_.push_back({Shifted(ink, left_, 0), color.red, color.green, color.blue, 1}); }

  // The text, with its baseline centred at `place`, but not beyond the picture's sides, and `right` pixels from the right one. One that is
  // too wide shrinks.
  Status PutText(const std::string& text, InkPoint place, Color color = kWhite, double right = 0) {
    const Result<std::pair<Ink, int>> fitted = Fitted(text);
    if (!fitted.ok()) return fitted.status();
    const auto& [ink, width] = *fitted;
    const int least = scale_.margin, most = std::max(size_.width - std::max(scale_.margin, int(right)) - width, least);
    Put(Shifted(ink, std::clamp(int(std::lround(place.x - 0.5 * width)), least, most), int(std::lround(place.y))), color);
    return Status::Ok();
  }
  // Its baseline begins at `place`.
  Status PutTextFrom(const std::string& text, InkPoint place) {
    const Result<std::pair<Ink, int>> fitted = Fitted(text);
    if (fitted.ok()) Put(Shifted(fitted->first, int(std::lround(place.x)), int(std::lround(place.y))), kWhite);
    return fitted.status();
  }

  // The text's ink and width.
  Result<std::pair<Ink, int>> Fitted(const std::string& text) const {
    const int room = std::max(size_.width - 2 * scale_.margin, 1);
    int letters = scale_.letters;
    Result<int> width = TextWidth(text, letters);
    while (width.ok() && *width > room && letters > 1) {
      letters = std::clamp(int(std::int64_t{letters} * room / *width), 1, letters - 1);
      width = TextWidth(text, letters);
    }
    if (!width.ok()) return width.status();
    Result<Ink> ink = TextInk(text, letters);
    if (!ink.ok()) return ink.status();
    return std::pair(*std::move(ink), *width);
  }

  ImageSize size_;
  int left_;
  PictureGeometry geometry_;
  Scale scale_;
  double top_ = scale_.margin;  // of the room that is left
  double right_ = 0;            // what is taken of it
  std::vector<ColoredInk> layers_;
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

Status CheckCanDraw(const Annotations& annotations) { return annotations.any() ? AnnotationFont().status() : Status::Ok(); }

Result<AnnotationLayers> AnnotationLayers::Draw(const Annotations& annotations, ImageSize size, std::span<const PictureGeometry> panes,
                                                const PictureKey& key) {
  CHECK(!panes.empty());
  const ImageSize pane = {size.width / int(panes.size()), size.height};
  const Scale scale(pane);
  AnnotationLayers layers;
  const auto keep = [&layers](std::vector<ColoredInk> more) { std::ranges::move(more, std::back_inserter(layers.layers_)); };

  Artist whole(size, 0, panes.front(), scale);
  Status status;
  if (!annotations.title.empty()) status = whole.DrawTitle(annotations.title);
  if (status.ok() && annotations.color_bar && key.bar) status = whole.DrawColorBar(*key.bar, *annotations.color_bar);
  if (status.ok() && annotations.legend && !key.entries.empty()) status = whole.DrawLegend(key.entries);
  if (!status.ok()) return status;
  keep(whole.TakeLayers());

  for (std::size_t i = 0; i < panes.size(); ++i) {
    const PictureGeometry& geometry = panes[i];
    Artist artist(pane, int(i) * pane.width, geometry, scale);
    artist.KeepClear(whole.top(), i + 1 == panes.size() ? whole.right() : 0);
    const bool sides = annotations.orientation_marker && geometry.world == World::kPatient;
    if (sides) status = artist.DrawSides();
    if (status.ok() && annotations.orientation_marker && !(sides && annotations.sides_only)) status = artist.DrawAxes();
    if (status.ok() && annotations.scale_bar) status = artist.DrawScaleBar();
    if (!status.ok()) return status;
    keep(artist.TakeLayers());
  }
  return layers;
}

void AnnotationLayers::PutOver(int y, std::span<float> rgba) const {
  const auto width = std::int32_t(rgba.size() / 4);
  for (const ColoredInk& layer : layers_) {
    const PixelBounds& b = layer.ink.bounds;
    if (y < b.y_begin || y >= b.y_end) continue;
    const float* row = &layer.ink.coverage[std::size_t(y - b.y_begin) * std::size_t(b.width())];
    for (std::int32_t x = std::max(b.x_begin, 0); x < std::min(b.x_end, width); ++x) {
      const float alpha = layer.opacity * row[x - b.x_begin];
      if (alpha == 0) continue;
      const float front[4] = {alpha * layer.red, alpha * layer.green, alpha * layer.blue, alpha};
      float* out = &rgba[4 * std::size_t(x)];
      for (int c = 0; c < 4; ++c) out[c] = front[c] + (1 - alpha) * out[c];
    }
  }
}

}  // namespace slabstream
