#include "client/image_io/annotations.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <utility>

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

// Draws the annotations of one picture, each by one function.
class Artist {
 public:
  Artist(ImageSize size, const PictureGeometry& geometry) : size_(size), geometry_(geometry), scale_(size) {}

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
                                               {geometry_.right, {double(size_.width), y}}};
    for (const auto& [direction, place] : sides) {
      if (Status status = PutText(PatientSides(direction), place); !status.ok()) return status;
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

  std::vector<ColoredInk> TakeLayers() { return std::move(layers_); }

 private:
  // The ink on its halo.
  void Put(const Ink& ink, Color color) {
    layers_.push_back({Grown(ink, scale_.halo), 0, 0, 0, kHaloOpacity});
    layers_.push_back({ink, color.red, color.green, color.blue, 1});
  }

  // The text, with its baseline centred at `place`, but not beyond the picture's sides. One that is too wide shrinks.
  Status PutText(const std::string& text, InkPoint place, Color color = kWhite) {
    const int room = std::max(size_.width - 2 * scale_.margin, 1);
    int letters = scale_.letters;
    Result<int> width = TextWidth(text, letters);
    while (width.ok() && *width > room && letters > 1) {
      letters = std::clamp(int(std::int64_t{letters} * room / *width), 1, letters - 1);
      width = TextWidth(text, letters);
    }
    if (!width.ok()) return width.status();
    const Result<Ink> ink = TextInk(text, letters);
    if (!ink.ok()) return ink.status();
    const int least = scale_.margin, most = std::max(size_.width - scale_.margin - *width, least);
    Put(Shifted(*ink, std::clamp(int(std::lround(place.x - 0.5 * *width)), least, most), int(std::lround(place.y))), color);
    return Status::Ok();
  }

  ImageSize size_;
  PictureGeometry geometry_;
  Scale scale_;
  double top_ = scale_.margin;  // of the room that is left
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

Result<AnnotationLayers> AnnotationLayers::Draw(const Annotations& annotations, ImageSize size, const PictureGeometry& geometry) {
  Artist artist(size, geometry);
  Status status;
  if (!annotations.title.empty()) status = artist.DrawTitle(annotations.title);
  if (status.ok() && annotations.orientation_marker && geometry.world == World::kPatient) status = artist.DrawSides();
  if (status.ok() && annotations.orientation_marker) status = artist.DrawAxes();
  if (status.ok() && annotations.scale_bar) status = artist.DrawScaleBar();
  if (!status.ok()) return status;
  AnnotationLayers layers;
  layers.layers_ = artist.TakeLayers();
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
