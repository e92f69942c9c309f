// The picture that a file shows: what was rendered, over its background and under its annotations. Depths stay as they are.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "client/pictures/annotations.h"
#include "client/pictures/picture_format.h"
#include "common/base/status.h"
#include "common/image/picture_image.h"
#include "common/view/picture_geometry.h"

namespace slabstream {

// Rows are made one by one, so that no second copy of the picture is needed. Any thread.
class ComposedPicture {
 public:
  // `image` must outlive this; its bounds lie within `size`. `panes`: of pictures side by
  // side, of equal widths, at least one. NotFound: the font of annotations.
  static Result<ComposedPicture> Make(const PictureImage& image, ImageSize size, const PictureFormat& format,
                                      std::span<const PictureGeometry> panes, const PictureKey& key = {});
  static Result<ComposedPicture> Make(const PictureImage& image, ImageSize size, const PictureFormat& format,
                                      const PictureGeometry& geometry, const PictureKey& key = {}) {
    return Make(image, size, format, {&geometry, 1}, key);
  }

  // The same with these annotations alone, such as those below the picture for files that keep the others as marks. Those below come first.
  static Result<ComposedPicture> WithMarks(const PictureImage& image, ImageSize size, const StraightColor& background,
                                           std::span<const Mark> marks);

  ImageSize size() const { return size_; }
  bool has_depth() const { return image_->has_depth(); }

  // Row y of the picture: size().width * 4 premultiplied floats, and as many depths as the row has pixels if `depth` is not empty
  // (+infinity where nothing is seen).
  void Row(int y, std::span<float> rgba, std::span<float> depth) const;
  // The same row in the codes of a PNG of 8 or 16 bits (StraightCodes).
  void StraightRow(int y, std::span<std::uint8_t> codes) const;
  void StraightRow(int y, std::span<std::uint16_t> codes) const;
  // The same row over black as far as the picture is transparent, in codes of 8 bits; the fourth of each pixel does not count.
  void OpaqueRow(int y, std::span<std::uint8_t> codes) const;

 private:
  ComposedPicture(const PictureImage& image, ImageSize size, const StraightColor& background, AnnotationLayers under,
                  AnnotationLayers over);

  template <class Code>
  void CodeRow(int y, std::span<Code> codes) const;
  // The image, if its codes are those of the picture; else null.
  const StraightImage* Codes() const;

  const PictureImage* image_;
  ImageSize size_;
  Premultiplied background_;
  AnnotationLayers under_, over_;  // the picture
};

// A frame of a movie: size.width * size.height * 3 bytes, red, green and blue, row 0 first. A movie has no transparency: behind whatever
// the background lets through lies black.
std::vector<std::byte> MovieFrame(const ComposedPicture& picture);

}  // namespace slabstream
