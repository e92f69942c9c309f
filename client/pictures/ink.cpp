#include "client/pictures/ink.h"

#include <fmt/format.h>
#include <ft2build.h>
#include FT_FREETYPE_H

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdlib>
#include <filesystem>

#include "common/files/program_beside.h"
#include "common/text/utf8.h"

namespace slabstream {
namespace {

constexpr const char* kFont = "DejaVuSans-Bold.ttf";
constexpr const char* kFontFolder = "/usr/share/fonts/truetype/dejavu";
constexpr const char* kFontPackage = "fonts-dejavu-core";
constexpr const char* kFontVariable = "SLABSTREAM_FONT";

Ink Blank(const PixelBounds& bounds) { return {bounds, std::vector<float>(std::size_t(bounds.pixel_count()))}; }

float& At(Ink& ink, int x, int y) {
  const PixelBounds& b = ink.bounds;
  return ink.coverage[std::size_t(y - b.y_begin) * std::size_t(b.width()) + std::size_t(x - b.x_begin)];
}

// The pixels round these points, `margin` pixels more on each side.
PixelBounds BoundsOf(std::span<const InkPoint> points, double margin) {
  const auto [left, right] = std::ranges::minmax(points, {}, &InkPoint::x);
  const auto [top, bottom] = std::ranges::minmax(points, {}, &InkPoint::y);
  return {int(std::floor(left.x - margin)), int(std::floor(top.y - margin)), int(std::ceil(right.x + margin)),
          int(std::ceil(bottom.y + margin))};
}

// A shape by the signed distance of a point to its edge, negative inside.
template <class Distance>
Ink ShapeInk(const PixelBounds& bounds, Distance&& distance) {
  Ink ink = Blank(bounds);
  for (int y = bounds.y_begin; y < bounds.y_end; ++y) {
    for (int x = bounds.x_begin; x < bounds.x_end; ++x) {
      At(ink, x, y) = float(std::clamp(0.5 - distance(InkPoint{x + 0.5, y + 0.5}), 0.0, 1.0));
    }
  }
  return ink;
}

constexpr FT_Int32 kDraw = FT_LOAD_RENDER | FT_LOAD_NO_BITMAP;  // 256 levels of gray, from outlines

}  // namespace

Ink RectangleInk(InkPoint begin, InkPoint end) {
  Ink ink = Blank(BoundsOf(std::array{begin, end}, 0));
  const auto overlap = [](int pixel, double from, double to) {
    return std::clamp(std::min(pixel + 1.0, to) - std::max(double(pixel), from), 0.0, 1.0);
  };
  for (int y = ink.bounds.y_begin; y < ink.bounds.y_end; ++y) {
    for (int x = ink.bounds.x_begin; x < ink.bounds.x_end; ++x)
      At(ink, x, y) = float(overlap(x, begin.x, end.x) * overlap(y, begin.y, end.y));
  }
  return ink;
}

namespace {

// The signed distance of a point to the edge of a stroke, negative inside.
double DistanceTo(const Stroke& stroke, InkPoint p) {
  const InkPoint begin = stroke.begin;
  const double dx = stroke.end.x - begin.x, dy = stroke.end.y - begin.y, square = dx * dx + dy * dy;
  const double along = square > 0 ? std::clamp(((p.x - begin.x) * dx + (p.y - begin.y) * dy) / square, 0.0, 1.0) : 0.0;
  return std::hypot(p.x - begin.x - along * dx, p.y - begin.y - along * dy) - 0.5 * stroke.width;
}

}  // namespace

Ink StrokeInk(InkPoint begin, InkPoint end, double width) {
  return ShapeInk(BoundsOf(std::array{begin, end}, 0.5 * width + 1), [&](InkPoint p) { return DistanceTo({begin, end, width}, p); });
}

void CoverRow(const Stroke& stroke, int y, std::span<float> coverage) {
  // The part of the line near the row says which pixels can be covered.
  const double reach = 0.5 * stroke.width + 1, dx = stroke.end.x - stroke.begin.x, dy = stroke.end.y - stroke.begin.y;
  const double middle = y + 0.5 - stroke.begin.y;
  double first = 0, last = 1;
  if (std::abs(dy) > 1) {
    const auto [low, high] = std::minmax({(middle - reach) / dy, (middle + reach) / dy});
    first = std::max(first, low);
    last = std::min(last, high);
  } else if (std::abs(middle) > reach + 1) {
    return;
  }
  if (first > last) return;
  const auto [left, right] = std::minmax({stroke.begin.x + first * dx, stroke.begin.x + last * dx});
  const double width = double(coverage.size());
  const int end = int(std::clamp(right + reach, 0.0, width));
  for (int x = int(std::clamp(left - reach, 0.0, width)); x < end; ++x) {
    float& here = coverage[std::size_t(x)];
    here = std::max(here, float(std::clamp(0.5 - DistanceTo(stroke, {x + 0.5, y + 0.5}), 0.0, 1.0)));
  }
}

Ink PolygonInk(std::span<const InkPoint> corners) {
  return ShapeInk(BoundsOf(corners, 1), [&](InkPoint p) {
    double farthest = -1e9;
    for (std::size_t i = 0; i < corners.size(); ++i) {
      const InkPoint a = corners[i], b = corners[(i + 1) % corners.size()];
      const double dx = b.x - a.x, dy = b.y - a.y, length = std::hypot(dx, dy);
      if (length > 0) farthest = std::max(farthest, ((p.x - a.x) * dy - (p.y - a.y) * dx) / length);
    }
    return farthest;
  });
}

Ink Union(const Ink& a, const Ink& b) {
  Ink both = Blank(Union(a.bounds, b.bounds));
  for (const Ink* ink : {&a, &b}) {
    std::size_t i = 0;
    for (int y = ink->bounds.y_begin; y < ink->bounds.y_end; ++y) {
      for (int x = ink->bounds.x_begin; x < ink->bounds.x_end; ++x, ++i) At(both, x, y) = std::max(At(both, x, y), ink->coverage[i]);
    }
  }
  return both;
}

Ink Grown(const Ink& ink, double radius) {
  struct Offset {
    int x, y;
    float share;
  };
  const int reach = int(std::ceil(radius + 0.5));
  std::vector<Offset> disc;
  for (int y = -reach; y <= reach; ++y) {
    for (int x = -reach; x <= reach; ++x) {
      const double share = std::clamp(radius + 0.5 - std::hypot(x, y), 0.0, 1.0);
      if (share > 0) disc.push_back({x, y, float(share)});
    }
  }
  const PixelBounds& b = ink.bounds;
  Ink grown = Blank({b.x_begin - reach, b.y_begin - reach, b.x_end + reach, b.y_end + reach});
  const std::ptrdiff_t row = b.width();
  std::size_t i = 0;
  for (int y = b.y_begin; y < b.y_end; ++y) {
    for (int x = b.x_begin; x < b.x_end; ++x, ++i) {
      const float coverage = ink.coverage[i];
      if (coverage == 0) continue;
      // What is near a point inside of a shape is inside of it, or near its edge.
      const bool at_edge = x == b.x_begin || x == b.x_end - 1 || y == b.y_begin || y == b.y_end - 1;
      const float* here = &ink.coverage[i];
      if (!at_edge && here[-1] == 1 && here[1] == 1 && here[-row] == 1 && here[row] == 1) {
        At(grown, x, y) = coverage;
        continue;
      }
      for (const Offset& o : disc) At(grown, x + o.x, y + o.y) = std::max(At(grown, x + o.x, y + o.y), coverage * o.share);
    }
  }
  return grown;
}

Ink Shifted(Ink ink, int x, int y) {
  PixelBounds& b = ink.bounds;
  b = {b.x_begin + x, b.y_begin + y, b.x_end + x, b.y_end + y};
  return ink;
}

Result<std::string> AnnotationFont() {
  const char* named = std::getenv(kFontVariable);
  std::error_code error;
  if (named != nullptr && *named != '\0') {
    if (std::filesystem::is_regular_file(named, error)) return std::string(named);
    return Status::NotFound(fmt::format("${} names '{}', which is no file", kFontVariable, named));
  }
  const std::filesystem::path installed = std::filesystem::path(kFontFolder) / kFont;
  for (const std::filesystem::path& font : {ProgramFolder() / kFont, installed}) {
    if (std::filesystem::is_regular_file(font, error)) return font.string();
  }
  return Status::NotFound(fmt::format("annotations need the font {} of the package {}, or one that ${} names", installed.string(),
                                      kFontPackage, kFontVariable));
}

void Font::Done::operator()(FT_LibraryRec_* library) const { FT_Done_FreeType(library); }
void Font::Done::operator()(FT_FaceRec_* face) const { FT_Done_Face(face); }

Result<Font> Font::Open() {
  const Result<std::string> file = AnnotationFont();
  if (!file.ok()) return file.status();
  Font font;
  FT_Library library = nullptr;
  FT_Face face = nullptr;
  if (FT_Init_FreeType(&library) != 0) return Status::Internal("FreeType cannot be started");
  font.library_.reset(library);
  const bool readable = FT_New_Face(library, file->c_str(), 0, &face) == 0;
  font.face_.reset(face);
  if (!readable || !FT_IS_SCALABLE(face)) return Status::InvalidArgument(fmt::format("the font '{}' cannot be read", *file));
  return font;
}

template <class Visit>
int Font::Lay(std::string_view text, int size, int flags, Visit&& visit) {
  constexpr int kShift = 6;  // positions are in 64ths of a pixel
  FT_Set_Pixel_Sizes(face_.get(), 0, FT_UInt(size));
  FT_Pos pen = 0;
  while (!text.empty()) {
    const std::size_t bytes = std::max<std::size_t>(Utf8CharacterBytes(text), 1);
    const char32_t character = Utf8Character(text.substr(0, bytes));
    text.remove_prefix(bytes);
    if (FT_Load_Char(face_.get(), character, flags) != 0) continue;
    visit(*face_->glyph, int((pen + 32) >> kShift));
    pen += face_->glyph->advance.x;
  }
  return int((pen + 32) >> kShift);
}

int Font::Width(std::string_view text, int size) {
  return Lay(text, size, FT_LOAD_DEFAULT, [](const FT_GlyphSlotRec&, int) {});
}

Ink Font::Draw(std::string_view text, int size) {
  const auto bounds_of = [](const FT_GlyphSlotRec& glyph, int pen) {
    const int left = pen + glyph.bitmap_left, top = -glyph.bitmap_top;
    return PixelBounds{left, top, left + int(glyph.bitmap.width), top + int(glyph.bitmap.rows)};
  };
  Ink ink;
  Lay(text, size, kDraw, [&](const FT_GlyphSlotRec& glyph, int pen) { ink.bounds = Union(ink.bounds, bounds_of(glyph, pen)); });
  ink = Blank(ink.bounds);
  Lay(text, size, kDraw, [&](const FT_GlyphSlotRec& glyph, int pen) {
    if (glyph.bitmap.pixel_mode != FT_PIXEL_MODE_GRAY) return;
    const PixelBounds b = bounds_of(glyph, pen);
    for (int y = b.y_begin; y < b.y_end; ++y) {
      const unsigned char* row = glyph.bitmap.buffer + std::ptrdiff_t{y - b.y_begin} * glyph.bitmap.pitch;
      for (int x = b.x_begin; x < b.x_end; ++x) At(ink, x, y) = std::max(At(ink, x, y), float(row[x - b.x_begin]) / 255);
    }
  });
  return ink;
}

}  // namespace slabstream
