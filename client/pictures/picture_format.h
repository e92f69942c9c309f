// PictureFormat: how pixels become the picture that a file shows.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "common/classification/rgb.h"

namespace slabstream {

struct StraightColor {
  float r = 0, g = 0, b = 0, a = 0;  // each in [0, 1]
  friend bool operator==(const StraightColor&, const StraightColor&) = default;
};

// What shows where a volume lies, round it: the edges of its box; with numbers along three of them; with lines on the faces behind it, too.
enum class VolumeAxes : std::uint8_t { kOff, kBox, kTicks, kGrid };
inline constexpr std::array<std::string_view, 4> kVolumeAxesNames = {"off", "box", "axes", "grid"};

struct Annotations {
  bool scale_bar = false;
  bool orientation_marker = false;  // the axes of the world; of patients also the letters of the sides
  bool sides_only = false;          // a patient's sides as letters, without axes, as is usual in slices
  VolumeAxes axes = VolumeAxes::kOff;
  std::string title;  // empty: none
  // What the picture's key says (PictureKey); a key that has nothing of it leaves them out.
  std::optional<std::string> color_bar;  // its caption, such as a unit; "": none
  bool legend = false;
  std::optional<double> font_size;  // points, [kMinFontSize, kMaxFontSize]; none: as the picture's size suggests (annotations.h)

  bool any() const { return scale_bar || orientation_marker || axes != VolumeAxes::kOff || !title.empty() || needs_key(); }
  bool needs_key() const { return color_bar || legend; }
  friend bool operator==(const Annotations&, const Annotations&) = default;
};

inline constexpr double kMinFontSize = 1, kMaxFontSize = 1000;
inline constexpr int kMaxDotsPerInch = 10000;
inline constexpr int kUsualDotsPerInch = 72;  // a point is a pixel

struct PictureFormat {
  int png_bits = 8;          // bits of PNG and TIFF, 8 or 16; EXR is always float, the others and frames of movies have 8
  int quality = 90;          // the quality of JPEG and WebP, [1, 100]
  StraightColor background;  // put behind the picture; the default leaves it as it is
  Annotations annotations;   // drawn onto it
  // Pixels an inch, [1, kMaxDotsPerInch], which the file states; none: it states the size of pixels in the world, if that is known.
  std::optional<int> dots_per_inch;
};

// The background, if nothing shows through it.
inline std::optional<Rgb> OpaqueBackground(const PictureFormat& format) {
  const StraightColor& b = format.background;
  return b.a == 1 ? std::optional(Rgb{b.r, b.g, b.b}) : std::nullopt;
}

// Whether PNGs of this format hold the codes of the picture itself or of it over OpaqueBackground, so that a picture in these codes
// (FrameRequest::straight8) is enough.
inline bool HoldsStraight8(const PictureFormat& format) {
  return format.png_bits == 8 && (format.background.a == 0 || OpaqueBackground(format)) && !format.annotations.any();
}

// For files without transparency: behind whatever the background lets through lies black.
inline PictureFormat WithoutTransparency(PictureFormat format) {
  StraightColor& b = format.background;
  b = {b.r * b.a, b.g * b.a, b.b * b.a, 1};
  return format;
}

}  // namespace slabstream
