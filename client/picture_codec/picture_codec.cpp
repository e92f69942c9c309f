#include "client/picture_codec/picture_codec.h"

#include <png.h>
#include <zlib.h>

#include <algorithm>
#include <csetjmp>
#include <cstdio>  // jpeglib.h needs FILE
#include <cstdlib>
#include <cstring>
#include <new>

#include <jpeglib.h>

#include "common/image/sample_codes.h"

namespace slabstream {
namespace {

// ---- JPEG

// libjpeg ends the process on errors unless told otherwise. Encoding to memory fails only for want of it.
[[noreturn]] void OutOfMemory(j_common_ptr) { throw std::bad_alloc(); }

struct JpegWriter {
  JpegWriter() {
    info.err = jpeg_std_error(&errors);
    errors.error_exit = OutOfMemory;
    jpeg_create_compress(&info);
    jpeg_mem_dest(&info, &bytes, &size);
  }
  ~JpegWriter() {
    jpeg_destroy_compress(&info);
    std::free(bytes);  // NOLINT: libjpeg took it from malloc
  }
  JpegWriter(const JpegWriter&) = delete;
  JpegWriter& operator=(const JpegWriter&) = delete;

  jpeg_compress_struct info{};
  jpeg_error_mgr errors{};
  unsigned char* bytes = nullptr;
  unsigned long size = 0;  // NOLINT(google-runtime-int): libjpeg's type
};

// ---- PNG

struct PngWriter {
  PngWriter() {
    png = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, Fail, nullptr);
    info = png == nullptr ? nullptr : png_create_info_struct(png);
    if (info == nullptr) throw std::bad_alloc();
    png_set_write_fn(png, &bytes, Write, nullptr);
  }
  ~PngWriter() { png_destroy_write_struct(&png, &info); }
  PngWriter(const PngWriter&) = delete;
  PngWriter& operator=(const PngWriter&) = delete;

  [[noreturn]] static void Fail(png_structp, png_const_charp) { throw std::bad_alloc(); }
  static void Write(png_structp png, png_bytep data, std::size_t size) {
    auto& bytes = *static_cast<std::vector<std::byte>*>(png_get_io_ptr(png));
    const auto* begin = reinterpret_cast<const std::byte*>(data);
    bytes.insert(bytes.end(), begin, begin + size);
  }

  png_structp png = nullptr;
  png_infop info = nullptr;
  std::vector<std::byte> bytes;
};

}  // namespace

std::vector<std::byte> EncodeJpeg(const ComposedPicture& picture, const PixelBounds& bounds, int quality) {
  constexpr int kFullColorFrom = 85;
  JpegWriter writer;
  jpeg_compress_struct& info = writer.info;
  info.image_width = JDIMENSION(bounds.width());
  info.image_height = JDIMENSION(bounds.height());
  info.input_components = 4;
  info.in_color_space = JCS_EXT_RGBX;
  jpeg_set_defaults(&info);
  jpeg_set_quality(&info, quality, TRUE);
  info.comp_info[0].h_samp_factor = info.comp_info[0].v_samp_factor = quality >= kFullColorFrom ? 1 : 2;
  jpeg_start_compress(&info, TRUE);
  std::vector<float> rgba(4 * std::size_t(picture.size().width));
  std::vector<std::uint8_t> codes(4 * std::size_t(bounds.width()));
  const std::size_t first = 4 * std::size_t(bounds.x_begin);
  for (int y = bounds.y_begin; y < bounds.y_end; ++y) {
    picture.Row(y, rgba, {});
    SampleCodes(rgba.data() + first, codes.size(), codes.data());
    JSAMPROW row = codes.data();
    jpeg_write_scanlines(&info, &row, 1);
  }
  jpeg_finish_compress(&info);
  const auto* begin = reinterpret_cast<const std::byte*>(writer.bytes);
  return {begin, begin + writer.size};
}

std::optional<std::vector<std::byte>> EncodePng(const ComposedPicture& picture, const PixelBounds& bounds,
                                                const std::atomic<bool>& given_up) {
  constexpr int kFastest = 1;
  PngWriter writer;
  png_set_compression_level(writer.png, kFastest);
  png_set_filter(writer.png, PNG_FILTER_TYPE_BASE, PNG_FILTER_UP);  // smallest of those that cost one subtraction, on our pictures
  png_set_compression_buffer_size(writer.png, std::size_t{1} << 18);
  png_set_IHDR(writer.png, writer.info, png_uint_32(bounds.width()), png_uint_32(bounds.height()), 8, PNG_COLOR_TYPE_RGBA,
               PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
  png_write_info(writer.png, writer.info);
  std::vector<std::uint8_t> codes(4 * std::size_t(picture.size().width));
  for (int y = bounds.y_begin; y < bounds.y_end; ++y) {
    if (given_up.load(std::memory_order_relaxed)) return std::nullopt;
    picture.StraightRow(y, codes);
    png_write_row(writer.png, codes.data() + 4 * std::size_t(bounds.x_begin));
  }
  png_write_end(writer.png, nullptr);
  return std::move(writer.bytes);
}

}  // namespace slabstream
