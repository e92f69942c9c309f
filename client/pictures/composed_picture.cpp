#include "client/pictures/composed_picture.h"

#include <algorithm>
#include <limits>

#include "common/base/check.h"
#include "common/image/sample_codes.h"
#include "common/kernels/combine.h"

namespace slabstream {

Result<ComposedPicture> ComposedPicture::Make(const PictureImage& image, ImageSize size, const PictureFormat& format,
                                              std::span<const PictureGeometry> panes, const PictureKey& key) {
  const Result<std::vector<Mark>> marks = MarksOf(format, size, panes, key);
  if (!marks.ok()) return marks.status();
  return WithMarks(image, size, format.background, *marks);
}

Result<ComposedPicture> ComposedPicture::WithMarks(const PictureImage& image, ImageSize size, const StraightColor& background,
                                                   std::span<const Mark> marks) {
  const auto below = std::size_t(std::ranges::find(marks, false, &Mark::under) - marks.begin());
  Result<AnnotationLayers> under = AnnotationLayers::Draw(marks.first(below)), over = AnnotationLayers::Draw(marks.subspan(below));
  if (!under.ok()) return under.status();
  if (!over.ok()) return over.status();
  return ComposedPicture(image, size, background, *std::move(under), *std::move(over));
}

ComposedPicture::ComposedPicture(const PictureImage& image, ImageSize size, const StraightColor& background, AnnotationLayers under,
                                 AnnotationLayers over)
    : image_(&image),
      size_(size),
      background_{background.r * background.a, background.g * background.a, background.b * background.a, background.a},
      under_(std::move(under)),
      over_(std::move(over)) {
  CHECK((PixelBounds{0, 0, size.width, size.height}.Contains(image.bounds())));
}

void ComposedPicture::Row(int y, std::span<float> rgba, std::span<float> depth) const {
  for (std::size_t i = 0; i < rgba.size(); i += 4) std::ranges::copy(background_, &rgba[i]);
  under_.PutOver(y, rgba);
  std::fill(depth.begin(), depth.end(), std::numeric_limits<float>::infinity());
  const PixelBounds& b = image_->bounds();
  if (!b.empty() && y >= b.y_begin && y < b.y_end) {
    const auto left = std::size_t(b.x_begin), width = std::size_t(b.width());
    float* const out = rgba.data() + 4 * left;
    std::vector<float> colors(4 * width);
    image_->ReadColors(y, colors.data());
    OverRow(colors.data(), out, out, width);
    if (!depth.empty()) image_->ReadDepths(y, depth.data() + left);
  }
  over_.PutOver(y, rgba);
}

template <class Code>
void ComposedPicture::CodeRow(int y, std::span<Code> codes) const {
  std::vector<float> rgba(codes.size());
  Row(y, rgba, {});
  StraightCodes(rgba.data(), codes.size() / 4, codes.data());
}

const StraightImage* ComposedPicture::Codes() const {
  const StraightImage* const image = image_->codes();
  return image != nullptr && image->behind == background_ && under_.empty() && over_.empty() ? image : nullptr;
}

void ComposedPicture::StraightRow(int y, std::span<std::uint8_t> codes) const {
  const StraightImage* const image = Codes();
  if (image == nullptr) return CodeRow(y, codes);
  const PixelBounds& b = image->bounds;
  const bool inside = !b.empty() && y >= b.y_begin && y < b.y_end;
  if (!inside || b.width() < size_.width) FillStraightCodes(background_, codes);
  if (!inside) return;
  const std::size_t row = 4 * std::size_t(b.width());
  std::copy_n(image->codes.data() + std::size_t(y - b.y_begin) * row, row, codes.data() + 4 * std::size_t(b.x_begin));
}

void ComposedPicture::StraightRow(int y, std::span<std::uint16_t> codes) const { CodeRow(y, codes); }

void ComposedPicture::OpaqueRow(int y, std::span<std::uint8_t> codes) const {
  if (Codes() != nullptr && background_[3] == 1) return StraightRow(y, codes);
  std::vector<float> rgba(codes.size());
  Row(y, rgba, {});
  SampleCodes(rgba.data(), rgba.size(), codes.data());
}

std::vector<std::byte> MovieFrame(const ComposedPicture& picture) {
  const auto width = std::size_t(picture.size().width), height = std::size_t(picture.size().height);
  std::vector<std::byte> frame(3 * width * height);
  std::vector<std::uint8_t> codes(4 * width);
  std::byte* out = frame.data();
  for (std::size_t y = 0; y < height; ++y) {
    picture.OpaqueRow(int(y), codes);
    for (std::size_t x = 0; x < width; ++x) {
      for (std::size_t c = 0; c < 3; ++c) *out++ = std::byte(codes[4 * x + c]);
    }
  }
  return frame;
}

}  // namespace slabstream
