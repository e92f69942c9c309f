// Video of pictures: what a decoder shows of it is the pictures, whatever their sizes.
#include "gateway/video_encoder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <vpx/vp8dx.h>
#include <vpx/vpx_decoder.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

#include "common/image/straight_image.h"

namespace slabstream {
namespace {

// A coloured ball on blue, which moves. Its edge is soft: colours are stored for 2 x 2 pixels.
PictureImage Ball(ImageSize size, int step) {
  StraightImage image{.bounds = {0, 0, size.width, size.height}, .codes = {}};
  for (int y = 0; y < size.height; ++y) {
    for (int x = 0; x < size.width; ++x) {
      const double r = std::hypot(x - size.width / 2.0 - 3 * step, y - size.height / 2.0) / size.height;
      const double ball = std::clamp((0.35 - r) / 0.2, 0.0, 1.0);
      for (const auto& [inside, outside] : {std::pair(0.9 - r, 0.1), std::pair(0.2 + r, 0.2), std::pair(0.3, 0.5), std::pair(1.0, 1.0)}) {
        image.codes.push_back(std::uint8_t(std::lround(255 * (outside + ball * (inside - outside)))));
      }
    }
  }
  return image;
}

class Decoder {
 public:
  Decoder() { EXPECT_EQ(vpx_codec_dec_init(&codec_, vpx_codec_vp9_dx(), nullptr, 0), VPX_CODEC_OK); }
  ~Decoder() { vpx_codec_destroy(&codec_); }
  Decoder(const Decoder&) = delete;
  Decoder& operator=(const Decoder&) = delete;

  // Root mean square of the difference, in codes, to what the chunk shows.
  double Difference(const VideoEncoder::Chunk& chunk, const ComposedPicture& picture) {
    const auto* bytes = reinterpret_cast<const std::uint8_t*>(chunk.bytes.data());
    EXPECT_EQ(vpx_codec_decode(&codec_, bytes, unsigned(chunk.bytes.size()), nullptr, 0), VPX_CODEC_OK);
    vpx_codec_iter_t next = nullptr;
    const vpx_image_t* image = vpx_codec_get_frame(&codec_, &next);
    if (image == nullptr || int(image->d_w) != picture.size().width || int(image->d_h) != picture.size().height) return 1e9;
    EXPECT_EQ(image->cs, VPX_CS_BT_709);
    EXPECT_EQ(image->range, VPX_CR_STUDIO_RANGE);
    const auto at = [&](int plane, int x, int y) { return double(image->planes[plane][y * image->stride[plane] + x]); };
    std::vector<std::uint8_t> row(4 * std::size_t(picture.size().width));
    double squares = 0;
    for (int y = 0; y < picture.size().height; ++y) {
      picture.OpaqueRow(y, row);
      for (int x = 0; x < picture.size().width; ++x) {
        const double luma = (at(VPX_PLANE_Y, x, y) - 16) * 255 / 219;
        const double blue = (at(VPX_PLANE_U, x / 2, y / 2) - 128) * 255 / 224, red = (at(VPX_PLANE_V, x / 2, y / 2) - 128) * 255 / 224;
        const double r = luma + 1.5748 * red, b = luma + 1.8556 * blue, g = (luma - 0.2126 * r - 0.0722 * b) / 0.7152;
        const std::uint8_t* codes = row.data() + 4 * x;
        for (const auto& [is, was] : {std::pair(r, codes[0]), std::pair(g, codes[1]), std::pair(b, codes[2])}) {
          squares += (std::clamp(is, 0.0, 255.0) - was) * (std::clamp(is, 0.0, 255.0) - was);
        }
      }
    }
    return std::sqrt(squares / (3.0 * picture.size().width * picture.size().height));
  }

 private:
  vpx_codec_ctx_t codec_{};
};

TEST(VideoEncoder, WhatIsShownIsThePictures) {
  VideoEncoder encoder;
  Decoder decoder;
  int pictures = 0;
  for (const ImageSize size : {ImageSize{256, 256}, ImageSize{128, 128}, ImageSize{255, 131}, ImageSize{33, 64}, ImageSize{1, 1}}) {
    std::size_t first = 0;
    for (int step = 0; step < 4; ++step) {
      const PictureImage image = Ball(size, step);
      const ComposedPicture picture = ComposedPicture::WithMarks(image, size, {}, {}).value();
      const auto chunk = encoder.Encode(picture);
      ASSERT_TRUE(chunk.ok()) << chunk.status().message();
      EXPECT_EQ(chunk->key, step == 0) << size.width;
      EXPECT_LT(decoder.Difference(*chunk, picture), 5) << size.width << " x " << size.height << ", picture " << step;
      if (step == 0) first = chunk->bytes.size();
      if (step > 0 && size.width >= 128) {
        EXPECT_LT(chunk->bytes.size(), first) << "it says what has changed";
      }
      ++pictures;
    }
  }
  EXPECT_EQ(pictures, 20);
}

TEST(VideoEncoder, AGreyPictureIsGrey) {
  VideoEncoder encoder;
  Decoder decoder;
  for (const std::uint8_t grey : {std::uint8_t{0}, std::uint8_t{16}, std::uint8_t{128}, std::uint8_t{255}}) {
    const ImageSize size{64, 64};
    StraightImage image{.bounds = {0, 0, 64, 64}, .codes = PooledVector<std::uint8_t>(std::size_t{4} * 64 * 64, grey)};
    for (std::size_t i = 3; i < image.codes.size(); i += 4) image.codes[i] = 255;
    const PictureImage shown(std::move(image));
    const ComposedPicture picture = ComposedPicture::WithMarks(shown, size, {}, {}).value();
    const auto chunk = encoder.Encode(picture);
    ASSERT_TRUE(chunk.ok());
    EXPECT_LT(decoder.Difference(*chunk, picture), 1.5) << int(grey);
  }
}

}  // namespace
}  // namespace slabstream
