// PictureImage: the pixels of a finished picture, as they came to a client: premultiplied floats, perhaps with depths, or the codes of a
// PNG of 8 bits, which take a quarter of the memory (FrameRequest::straight8). Pixels outside its bounds are empty.
#pragma once

#include <cstdint>
#include <utility>
#include <variant>

#include "common/image/local_image.h"
#include "common/image/straight_image.h"

namespace slabstream {

class PictureImage {
 public:
  PictureImage() = default;
  // An image that stores all its pixels.
  PictureImage(LocalImage floats) : pixels_(std::move(floats)) {}   // NOLINT(google-explicit-constructor): it is a picture
  PictureImage(StraightImage codes) : pixels_(std::move(codes)) {}  // NOLINT(google-explicit-constructor)

  const PixelBounds& bounds() const {
    return std::visit([](const auto& pixels) -> const PixelBounds& { return pixels.bounds; }, pixels_);
  }
  // One of both is null.
  const LocalImage* floats() const { return std::get_if<LocalImage>(&pixels_); }
  const StraightImage* codes() const { return std::get_if<StraightImage>(&pixels_); }
  bool has_depth() const { return floats() != nullptr && HasDepth(floats()->format); }

  // Premultiplied colours of row y of the bounds, counted in the picture: 4 * bounds().width() floats.
  void ReadColors(std::int32_t y, float* rgba) const;
  // Depths of the row, if the picture has any: bounds().width() floats.
  void ReadDepths(std::int32_t y, float* depth) const;
  bool IsEmpty() const;  // no pixel shows anything
  // The smallest rectangle that holds all pixels that are not empty; empty if there are none.
  PixelBounds ContentBounds() const;

 private:
  std::variant<LocalImage, StraightImage> pixels_;
};

}  // namespace slabstream
