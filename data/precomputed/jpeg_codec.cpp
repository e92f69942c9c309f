#include "data/precomputed/jpeg_codec.h"

#include <cstdio>
// jpeglib.h needs the types of stdio.h before it.
#include <fmt/format.h>
#include <jpeglib.h>

#include <array>
#include <csetjmp>
#include <cstdint>
#include <string>

#include "common/memory/pooled_vector.h"

namespace slabstream::precomputed {
namespace {

// libjpeg leaves by longjmp, so no function that calls it behind setjmp has objects with destructors.
class JpegPicture {
 public:
  JpegPicture() {
    jpeg_.err = jpeg_std_error(&errors_);
    jpeg_.client_data = this;
    errors_.error_exit = OnError;
    errors_.output_message = [](j_common_ptr) {};
  }
  ~JpegPicture() { jpeg_destroy_decompress(&jpeg_); }
  JpegPicture(const JpegPicture&) = delete;
  JpegPicture& operator=(const JpegPicture&) = delete;

  bool Begin(std::span<const std::byte> bytes) {
    if (setjmp(jump_) != 0) return false;
    jpeg_create_decompress(&jpeg_);
    jpeg_.progress = &progress_;
    jpeg_mem_src(&jpeg_, reinterpret_cast<const unsigned char*>(bytes.data()), static_cast<unsigned long>(bytes.size()));
    (void)jpeg_read_header(&jpeg_, TRUE);
    return true;
  }
  std::uint64_t pixels() const { return std::uint64_t{jpeg_.image_width} * jpeg_.image_height; }
  int components() const { return jpeg_.num_components; }

  // Rows of pixels, component by component of each. libjpeg fills up what is missing, and only warns.
  bool ReadRows(JSAMPLE* out) {
    if (setjmp(jump_) != 0) return false;
    jpeg_.out_color_space = jpeg_.num_components == 1 ? JCS_GRAYSCALE : JCS_RGB;
    (void)jpeg_start_decompress(&jpeg_);
    while (jpeg_.output_scanline < jpeg_.output_height) {
      JSAMPROW row = out + std::size_t(jpeg_.output_scanline) * jpeg_.image_width * std::size_t(jpeg_.num_components);
      (void)jpeg_read_scanlines(&jpeg_, &row, 1);
    }
    (void)jpeg_finish_decompress(&jpeg_);
    return errors_.num_warnings == 0;
  }

 private:
  static void OnError(j_common_ptr jpeg) { std::longjmp(static_cast<JpegPicture*>(jpeg->client_data)->jump_, 1); }
  // A picture with thousands of scans would take hours.
  static void OnProgress(j_common_ptr jpeg) {
    constexpr int kMostScans = 200;
    if (reinterpret_cast<j_decompress_ptr>(jpeg)->input_scan_number > kMostScans) OnError(jpeg);
  }

  jpeg_decompress_struct jpeg_{};
  jpeg_error_mgr errors_{};
  jpeg_progress_mgr progress_{.progress_monitor = OnProgress};
  std::jmp_buf jump_{};
};

class Jpeg : public ChunkCodec {
 public:
  Jpeg(std::uint64_t voxels, int channels) : voxels_(voxels), channels_(channels) {}

  Result<Bytes> Decode(Bytes packed, std::uint64_t most) const override {
    JpegPicture picture;
    if (!picture.Begin(packed.span())) return Status::DataLoss("damaged: not a JPEG picture");
    if (picture.pixels() != voxels_ || picture.components() != channels_) {
      return Status::DataLoss(fmt::format("is a JPEG picture of {} pixels of {} components, must be of {} of {}", picture.pixels(),
                                          picture.components(), voxels_, channels_));
    }
    const std::uint64_t bytes = voxels_ * std::uint64_t(channels_);
    if (bytes > most) return Status::ResourceExhausted(fmt::format("is a JPEG picture of {} bytes, at most {} are expected", bytes, most));
    UnwrittenVector<std::byte> pixels(bytes);
    if (!picture.ReadRows(reinterpret_cast<JSAMPLE*>(pixels.data()))) return Status::DataLoss("truncated or damaged: a JPEG picture");
    if (channels_ == 1) return Bytes(std::move(pixels));
    UnwrittenVector<std::byte> planes(bytes);
    const auto channels = std::size_t(channels_);
    for (std::size_t channel = 0; channel < channels; ++channel) {
      for (std::size_t i = 0; i < voxels_; ++i) planes[channel * voxels_ + i] = pixels[i * channels + channel];
    }
    return Bytes(std::move(planes));
  }

 private:
  const std::uint64_t voxels_;
  const int channels_;
};

}  // namespace

SharedCodec JpegCodec(std::uint64_t voxels, int channels) { return std::make_shared<Jpeg>(voxels, channels); }

}  // namespace slabstream::precomputed
