#include "gateway/video_encoder.h"

#include <fmt/format.h>
#include <vpx/vp8cx.h>
#include <vpx/vpx_encoder.h>

#include <algorithm>
#include <cstdint>
#include <string>

namespace slabstream {
namespace {

// Constant quality, [0, 63], 0 is the best: 20 is about as good as a JPEG of 70, with a third of the bytes (docs/performance.md).
constexpr int kQuality = 20;
constexpr int kSpeed = 8;  // [0, 9] of encoding in real time

// Two rows of RGBA codes as luma, and as chroma of 2 x 2 pixels, in fixed point: ITU-R BT.709-6 with codes of 16 to 235 and 16 to 240,
// since browsers take all video for such. The last column of an odd width counts twice.
void TwoRows(const std::uint8_t* upper, const std::uint8_t* lower, int width, std::uint8_t* luma0, std::uint8_t* luma1, std::uint8_t* blue,
             std::uint8_t* red) {
  constexpr int kR = 11966, kG = 40254, kB = 4064;  // of 2^16: 0.2126, 0.7152 and 0.0722, times 219 / 255
  const auto weighted = [](int r, int g, int b) { return kR * r + kG * g + kB * b; };
  const auto luma = [&](const std::uint8_t* p) { return std::uint8_t(16 + ((weighted(p[0], p[1], p[2]) + (1 << 15)) >> 16)); };
  for (int x = 0; x < width; ++x) luma0[x] = luma(upper + 4 * x);
  for (int x = 0; x < width; ++x) luma1[x] = luma(lower + 4 * x);
  constexpr int kWhole = 56284, kBlue = 36124, kRed = 42564;  // of 2^16: 219 / 255; 224 / 219 over 1.8556 and 1.5748
  for (int x = 0; x < width; x += 2) {
    const int left = 4 * x, right = 4 * std::min(x + 1, width - 1);
    const auto sum = [&](int channel) {
      return upper[left + channel] + upper[right + channel] + lower[left + channel] + lower[right + channel];
    };
    const int r = sum(0), g = sum(1), b = sum(2), y = weighted(r, g, b);
    const auto code = [&](int channel, int factor) {  // the sum is that of four pixels
      const int difference = (kWhole * channel - y + (1 << 9)) >> 10;
      return std::uint8_t(128 + ((difference * (factor >> 4) + (1 << 19)) >> 20));
    };
    blue[x / 2] = code(b, kBlue);
    red[x / 2] = code(r, kRed);
  }
}

}  // namespace

struct VideoEncoder::Stream {
  explicit Stream(ImageSize its_size) : size(its_size) {
    vpx_codec_enc_config_default(vpx_codec_vp9_cx(), &config, 0);
    config.g_w = unsigned(size.width);
    config.g_h = unsigned(size.height);
    config.g_timebase = {1, 1000};
    config.g_lag_in_frames = 0;  // each picture at once
    config.kf_mode = VPX_KF_DISABLED;
    config.rc_end_usage = VPX_Q;
    ok = vpx_codec_enc_init(&codec, vpx_codec_vp9_cx(), &config, 0) == VPX_CODEC_OK && Set(VP8E_SET_CPUUSED, kSpeed) &&
         Set(VP8E_SET_CQ_LEVEL, kQuality) && Set(VP9E_SET_COLOR_SPACE, VPX_CS_BT_709) && Set(VP9E_SET_COLOR_RANGE, VPX_CR_STUDIO_RANGE) &&
         vpx_img_alloc(&image, VPX_IMG_FMT_I420, config.g_w, config.g_h, 32) != nullptr;
    image.cs = VPX_CS_BT_709;
    image.range = VPX_CR_STUDIO_RANGE;
  }
  ~Stream() {
    if (image.img_data != nullptr) vpx_img_free(&image);
    if (codec.iface != nullptr) vpx_codec_destroy(&codec);
  }
  Stream(const Stream&) = delete;
  Stream& operator=(const Stream&) = delete;

  bool Set(int control, int value) { return vpx_codec_control_(&codec, control, value) == VPX_CODEC_OK; }

  ImageSize size;
  vpx_codec_enc_cfg_t config{};
  vpx_codec_ctx_t codec{};
  vpx_image_t image{};
  vpx_codec_pts_t pictures = 0;
  bool ok = false;
};

VideoEncoder::VideoEncoder() = default;
VideoEncoder::~VideoEncoder() = default;

Result<VideoEncoder::Chunk> VideoEncoder::Encode(const ComposedPicture& picture) {
  if (stream_ == nullptr || stream_->size != picture.size()) stream_ = std::make_unique<Stream>(picture.size());
  Stream& stream = *stream_;
  const auto [width, height] = stream.size;
  std::vector<std::uint8_t> upper(4 * std::size_t(width)), lower(upper.size());
  const auto row = [&](int plane, int y) { return stream.image.planes[plane] + std::ptrdiff_t(y) * stream.image.stride[plane]; };
  for (int y = 0; stream.ok && y < height; y += 2) {
    picture.OpaqueRow(y, upper);
    if (y + 1 < height) picture.OpaqueRow(y + 1, lower);
    const bool last = y + 1 == height;
    TwoRows(upper.data(), last ? upper.data() : lower.data(), width, row(VPX_PLANE_Y, y), row(VPX_PLANE_Y, last ? y : y + 1),
            row(VPX_PLANE_U, y / 2), row(VPX_PLANE_V, y / 2));
  }
  Chunk chunk;
  if (stream.ok && vpx_codec_encode(&stream.codec, &stream.image, stream.pictures++, 1, 0, VPX_DL_REALTIME) == VPX_CODEC_OK) {
    vpx_codec_iter_t next = nullptr;
    while (const vpx_codec_cx_pkt_t* packet = vpx_codec_get_cx_data(&stream.codec, &next)) {
      if (packet->kind != VPX_CODEC_CX_FRAME_PKT) continue;
      const auto* bytes = static_cast<const std::byte*>(packet->data.frame.buf);
      chunk.bytes.insert(chunk.bytes.end(), bytes, bytes + packet->data.frame.sz);
      chunk.key = (packet->data.frame.flags & VPX_FRAME_IS_KEY) != 0;
    }
  }
  if (!chunk.bytes.empty()) return chunk;
  const char* why = vpx_codec_error(&stream.codec);
  const std::string text = fmt::format("video of {} x {} pixels: {}", width, height, why == nullptr ? "libvpx made nothing" : why);
  stream_.reset();
  return Status::Internal(text);
}

}  // namespace slabstream
