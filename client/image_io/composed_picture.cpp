#include "client/image_io/composed_picture.h"

#include "common/base/check.h"

namespace slabstream {

Result<ComposedPicture> ComposedPicture::Make(const LocalImage& image, ImageSize size, const PictureFormat& format,
                                              const PictureGeometry& geometry) {
  CHECK((PixelBounds{0, 0, size.width, size.height}.Contains(image.bounds)));
  Result<AnnotationLayers> annotations = AnnotationLayers::Draw(format.annotations, size, geometry);
  if (!annotations.ok()) return annotations.status();
  return ComposedPicture(image, size, format.background, *std::move(annotations));
}

void ComposedPicture::Row(int y, std::span<float> rgba, std::span<float> depth) const {
  const float alpha = background_.a;
  const float behind[4] = {background_.r * alpha, background_.g * alpha, background_.b * alpha, alpha};
  for (std::size_t i = 0; i < rgba.size(); i += 4) std::copy_n(behind, 4, &rgba[i]);
  std::fill(depth.begin(), depth.end(), std::numeric_limits<float>::infinity());
  const PixelBounds& b = image_->bounds;
  if (!b.empty() && y >= b.y_begin && y < b.y_end) {
    const std::size_t first = std::size_t(y - b.y_begin) * std::size_t(b.width());
    const auto left = std::size_t(b.x_begin), width = std::size_t(b.width());
    for (std::size_t x = 0; x < width; ++x) {
      const float* front = &image_->rgba[4 * (first + x)];
      float* out = &rgba[4 * (left + x)];
      for (int c = 0; c < 4; ++c) out[c] = front[c] + (1 - front[3]) * behind[c];
      if (!depth.empty()) depth[left + x] = image_->depth[first + x];
    }
  }
  annotations_.PutOver(y, rgba);
}

std::vector<std::byte> MovieFrame(const ComposedPicture& picture) {
  const auto width = std::size_t(picture.size().width), height = std::size_t(picture.size().height);
  std::vector<std::byte> frame(3 * width * height);
  std::vector<float> rgba(4 * width);
  std::byte* out = frame.data();
  for (std::size_t y = 0; y < height; ++y) {
    picture.Row(int(y), rgba, {});
    for (std::size_t x = 0; x < width; ++x) {
      // Premultiplied colours are those over black.
      for (std::size_t c = 0; c < 3; ++c) *out++ = std::byte(SampleCode<std::uint8_t>(rgba[4 * x + c]));
    }
  }
  return frame;
}

}  // namespace slabstream
