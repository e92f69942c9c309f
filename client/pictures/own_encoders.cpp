// PNG by libpng, JPEG by libjpeg, WebP by libwebp.
#include <png.h>
#include <webp/encode.h>
#include <webp/mux.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <cmath>
#include <cstdio>  // jpeglib.h needs FILE
#include <cstring>
#include <new>
#include <utility>
#include <vector>

#include <jpeglib.h>

#include "client/pictures/exif.h"
#include "client/pictures/picture_encoder.h"
#include "common/parallel/parallel.h"

namespace slabstream {
namespace {

// Bytes of a file in their order. If some were not taken, no others are given.
class FileBytes {
 public:
  explicit FileBytes(const WriteBytes& write) : write_(write) {}

  bool ok() const { return ok_; }
  void Add(std::span<const std::byte> bytes) {
    ok_ = ok_ && write_(offset_, bytes);
    offset_ += std::int64_t(bytes.size());
  }

 private:
  const WriteBytes& write_;
  std::int64_t offset_ = 0;
  bool ok_ = true;
};

// ---- PNG

class PngWriter {
 public:
  explicit PngWriter(const WriteBytes& write) : bytes_(write) {
    png = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, Fail, nullptr);
    info = png == nullptr ? nullptr : png_create_info_struct(png);
    if (info == nullptr) throw std::bad_alloc();
    png_set_write_fn(png, this, Write, nullptr);
  }
  ~PngWriter() { png_destroy_write_struct(&png, &info); }
  PngWriter(const PngWriter&) = delete;
  PngWriter& operator=(const PngWriter&) = delete;

  bool ok() const { return bytes_.ok(); }

  png_structp png = nullptr;
  png_infop info = nullptr;

 private:
  // What we ask of libpng is right, and Write reports no errors to it: only memory can be lacking.
  [[noreturn]] static void Fail(png_structp, png_const_charp) { throw std::bad_alloc(); }
  static void Write(png_structp png, png_bytep data, std::size_t size) {
    static_cast<PngWriter*>(png_get_io_ptr(png))->bytes_.Add({reinterpret_cast<const std::byte*>(data), size});
  }

  FileBytes bytes_;
};

void AddText(PngWriter& writer, const char* name, std::string value) {
  std::string key = name;
  png_text text{};
  text.compression = PNG_TEXT_COMPRESSION_NONE;
  text.key = key.data();
  text.text = value.data();
  text.text_length = value.size();
  png_set_text(writer.png, writer.info, &text, 1);
}

// Some rows of a picture, compressed. Strips are made in parallel; one after the other they are the picture's stream of zlib.
struct PngStrip {
  std::vector<std::uint8_t> deflated;
  std::uint32_t adler = 0;
  std::size_t filtered_bytes = 0;
};

void Subtract(const std::uint8_t* __restrict row, const std::uint8_t* __restrict above, std::size_t bytes, std::uint8_t* __restrict out) {
  for (std::size_t i = 0; i < bytes; ++i) out[i] = std::uint8_t(row[i] - above[i]);  // the compiler vectorises it
}

// The rows, each less the one above it: the smallest of those filters that cost one subtraction, on our pictures. nullopt: `rows` failed.
std::optional<std::vector<std::uint8_t>> FilteredRows(const EncodedFormat& format, int begin, int end, const PictureRows& rows) {
  const std::size_t bytes = 4 * std::size_t(format.width) * std::size_t(format.bits / 8);
  std::vector<std::uint8_t> filtered((bytes + 1) * std::size_t(end - begin)), above(bytes), row(bytes);
  std::uint8_t* out = filtered.data();
  const bool complete = rows(std::max(begin - 1, 0), end, [&](int y, const void* samples) {
    std::memcpy(row.data(), samples, bytes);
    if (format.bits == 16 && std::endian::native == std::endian::little) {
      for (std::size_t i = 0; i < bytes; i += 2) std::swap(row[i], row[i + 1]);
    }
    if (y >= begin) {
      *out++ = PNG_FILTER_VALUE_UP;
      Subtract(row.data(), above.data(), bytes, out);
      out += bytes;
    }
    std::swap(row, above);
    return true;
  });
  return complete ? std::optional(std::move(filtered)) : std::nullopt;
}

// The usual level, 6, takes 1.7 times as long to render 60 pictures of a head, 8 % smaller. Z_RLE is hardly faster, and up to 15 % larger.
PngStrip Deflate(std::vector<std::uint8_t> filtered, bool last) {
  constexpr int kFastest = 1, kNoHeader = -15, kMemoryLevel = 8;
  z_stream stream{};
  if (deflateInit2(&stream, kFastest, Z_DEFLATED, kNoHeader, kMemoryLevel, Z_DEFAULT_STRATEGY) != Z_OK) throw std::bad_alloc();
  constexpr std::size_t kFlushBytes = 16;
  PngStrip strip{std::vector<std::uint8_t>(deflateBound(&stream, filtered.size()) + kFlushBytes), 0, filtered.size()};
  stream.next_in = filtered.data();
  stream.avail_in = uInt(filtered.size());
  stream.next_out = strip.deflated.data();
  stream.avail_out = uInt(strip.deflated.size());
  deflate(&stream, last ? Z_FINISH : Z_SYNC_FLUSH);
  strip.deflated.resize(stream.total_out);
  deflateEnd(&stream);
  strip.adler = std::uint32_t(adler32(adler32(0, nullptr, 0), filtered.data(), uInt(filtered.size())));
  return strip;
}

// False: `rows` or the writer failed.
bool WriteStrips(const EncodedFormat& format, const PictureRows& rows, PngWriter& writer) {
  constexpr std::size_t kStripBytes = std::size_t{1} << 19;
  const int strip_rows = std::max(1, int(kStripBytes / (std::size_t(format.width) * std::size_t(format.bits) / 2)));
  const int strips = (format.height + strip_rows - 1) / strip_rows;
  std::atomic<bool> ok = true;
  std::uint32_t adler = 1;
  const auto make = [&](std::int64_t number) {
    const int begin = int(number) * strip_rows, end = std::min(begin + strip_rows, format.height);
    auto filtered = ok ? FilteredRows(format, begin, end, rows) : std::nullopt;
    if (!filtered) ok = false;
    return filtered ? Deflate(*std::move(filtered), end == format.height) : PngStrip();
  };
  const auto use = [&](std::int64_t number, PngStrip strip) {
    if (!ok) return;
    constexpr std::array<std::uint8_t, 2> kHeader = {0x78, 0x01};  // of zlib: a window of 32 kB, the fastest level
    if (number == 0) strip.deflated.insert(strip.deflated.begin(), kHeader.begin(), kHeader.end());
    adler = std::uint32_t(adler32_combine(adler, strip.adler, z_off_t(strip.filtered_bytes)));
    for (int shift = 24; number + 1 == strips && shift >= 0; shift -= 8) strip.deflated.push_back(std::uint8_t(adler >> unsigned(shift)));
    png_write_chunk(writer.png, reinterpret_cast<png_const_bytep>("IDAT"), strip.deflated.data(), strip.deflated.size());
    if (!writer.ok()) ok = false;
  };
  ParallelInOrder(strips, 2 * ThreadsHere(), make, use);
  return ok;
}

std::optional<std::string> EncodePng(const EncodedFormat& format, const PictureRows& rows, const WriteBytes& write) {
  PngWriter writer(write);
  png_set_IHDR(writer.png, writer.info, png_uint_32(format.width), png_uint_32(format.height), format.bits, PNG_COLOR_TYPE_RGBA,
               PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
  png_set_sRGB_gAMA_and_cHRM(writer.png, writer.info, PNG_sRGB_INTENT_ABSOLUTE);
  if (format.density) {
    const auto density = png_uint_32(std::lround(*format.density));
    png_set_pHYs(writer.png, writer.info, density, density, PNG_RESOLUTION_METER);
  }
  if (!format.record.empty()) {
    AddText(writer, "Software", format.software);
    AddText(writer, format.record_name.c_str(), format.record);
  }
  png_write_info(writer.png, writer.info);
  const bool complete = WriteStrips(format, rows, writer);
  if (complete) png_write_chunk(writer.png, reinterpret_cast<png_const_bytep>("IEND"), nullptr, 0);
  if (complete && writer.ok()) return std::nullopt;
  return kBytesNotTaken;
}

// ---- JPEG

// libjpeg ends the process on errors unless told otherwise. JpegWriter tells it of none, so the only one that is left is a lack of memory.
[[noreturn]] void OutOfMemory(j_common_ptr) { throw std::bad_alloc(); }

// A destination of our own: that of jpeg_mem_dest knows the memory that it took only once the picture is complete, and pictures are given
// up halfway.
class JpegWriter {
 public:
  explicit JpegWriter(const WriteBytes& write) : bytes_(write) {
    info.err = jpeg_std_error(&errors_);
    errors_.error_exit = OutOfMemory;
    jpeg_create_compress(&info);
    info.client_data = this;
    info.dest = &destination_;
    destination_.init_destination = [](j_compress_ptr of) { Of(of).Reuse(); };
    destination_.empty_output_buffer = [](j_compress_ptr of) -> boolean {
      Of(of).Write(kBufferBytes);  // all of it: free_in_buffer tells the bytes before the last row
      return TRUE;
    };
    destination_.term_destination = [](j_compress_ptr of) { Of(of).Write(kBufferBytes - Of(of).destination_.free_in_buffer); };
  }
  ~JpegWriter() { jpeg_destroy_compress(&info); }
  JpegWriter(const JpegWriter&) = delete;
  JpegWriter& operator=(const JpegWriter&) = delete;

  bool ok() const { return bytes_.ok(); }

  jpeg_compress_struct info{};

 private:
  static constexpr std::size_t kBufferBytes = std::size_t{1} << 16;

  static JpegWriter& Of(j_compress_ptr info) { return *static_cast<JpegWriter*>(info->client_data); }
  void Reuse() {
    destination_.next_output_byte = buffer_.data();
    destination_.free_in_buffer = buffer_.size();
  }
  void Write(std::size_t size) {
    bytes_.Add(std::as_bytes(std::span(buffer_).first(size)));
    Reuse();
  }

  FileBytes bytes_;
  jpeg_error_mgr errors_{};
  jpeg_destination_mgr destination_{};
  std::vector<JOCTET> buffer_ = std::vector<JOCTET>(kBufferBytes);
};

// In whole pixels an inch; the other block (Exif) states fractions, too.
void StateDensity(const EncodedFormat& format, jpeg_compress_struct& info) {
  constexpr double kMost = 65535;
  const double density = std::round(format.density.value_or(0) * kMetresAnInch);
  if (density < 1 || density > kMost) return;
  info.density_unit = 1;
  info.X_density = info.Y_density = UINT16(density);
}
void AddExif(EncodedFormat format, jpeg_compress_struct& info) {
  constexpr std::size_t kMost = 65533;
  const std::string name("Exif\0\0", 6);
  if (name.size() + ExifBlock(format).size() > kMost) format.record.clear();  // a marker holds no more
  const std::string exif = ExifBlock(format), block = name + exif;
  if (!exif.empty()) jpeg_write_marker(&info, JPEG_APP0 + 1, reinterpret_cast<const JOCTET*>(block.data()), unsigned(block.size()));
}

std::optional<std::string> EncodeJpeg(const EncodedFormat& format, const PictureRows& rows, const WriteBytes& write) {
  constexpr int kFullColorFrom = 85;
  JpegWriter writer(write);
  jpeg_compress_struct& info = writer.info;
  info.image_width = JDIMENSION(format.width);
  info.image_height = JDIMENSION(format.height);
  info.input_components = 4;
  info.in_color_space = JCS_EXT_RGBX;
  jpeg_set_defaults(&info);
  jpeg_set_quality(&info, format.quality, TRUE);
  info.comp_info[0].h_samp_factor = info.comp_info[0].v_samp_factor = format.quality >= kFullColorFrom && !format.quickly ? 1 : 2;
  StateDensity(format, info);
  jpeg_start_compress(&info, TRUE);
  AddExif(format, info);
  const bool complete = rows(0, format.height, [&](int, const void* row) {
    auto* samples = const_cast<JSAMPROW>(static_cast<const JSAMPLE*>(row));  // libjpeg reads them only
    jpeg_write_scanlines(&info, &samples, 1);
    return writer.ok();
  });
  if (complete) jpeg_finish_compress(&info);
  if (complete && writer.ok()) return std::nullopt;
  return kBytesNotTaken;
}

// ---- WebP

struct WebpPicture : ::WebPPicture {
  WebpPicture() {
    if (WebPPictureInit(this) == 0) throw std::bad_alloc();
    WebPMemoryWriterInit(&bytes);
    writer = WebPMemoryWrite;
    custom_ptr = &bytes;
  }
  ~WebpPicture() {
    WebPPictureFree(this);
    WebPMemoryWriterClear(&bytes);
  }
  WebpPicture(const WebpPicture&) = delete;
  WebpPicture& operator=(const WebpPicture&) = delete;

  WebPMemoryWriter bytes{};
};

std::optional<std::string> Write(std::span<const std::uint8_t> bytes, const WriteBytes& write) {
  if (write(0, std::as_bytes(bytes))) return std::nullopt;
  return kBytesNotTaken;
}
std::optional<std::string> WriteWithExif(std::span<const std::uint8_t> picture, const std::string& exif, const WriteBytes& write) {
  const WebPData image = {picture.data(), picture.size()}, block = {reinterpret_cast<const std::uint8_t*>(exif.data()), exif.size()};
  WebPMux* const mux = WebPMuxCreate(&image, 0);
  WebPData file{};
  const bool made = mux != nullptr && WebPMuxSetChunk(mux, "EXIF", &block, 0) == WEBP_MUX_OK && WebPMuxAssemble(mux, &file) == WEBP_MUX_OK;
  WebPMuxDelete(mux);
  if (!made) throw std::bad_alloc();
  std::optional<std::string> failure = Write({file.bytes, file.size}, write);
  WebPDataClear(&file);
  return failure;
}

std::optional<std::string> EncodeWebp(const EncodedFormat& format, const PictureRows& rows, const WriteBytes& write) {
  const std::size_t stride = 4 * std::size_t(format.width);
  std::vector<std::uint8_t> pixels(stride * std::size_t(format.height));
  const bool complete = rows(0, format.height, [&](int y, const void* row) {
    std::memcpy(pixels.data() + std::size_t(y) * stride, row, stride);
    return true;
  });
  if (!complete) return kBytesNotTaken;
  WebPConfig config;
  WebpPicture picture;
  picture.width = format.width;
  picture.height = format.height;
  if (WebPConfigInit(&config) == 0) return "libwebp has another version than its header";
  config.quality = float(format.quality);
  if (WebPPictureImportRGBA(&picture, pixels.data(), int(stride)) == 0) throw std::bad_alloc();
  if (WebPEncode(&config, &picture) == 0) {
    if (picture.error_code == VP8_ENC_ERROR_OUT_OF_MEMORY) throw std::bad_alloc();
    return "libwebp reports error " + std::to_string(int(picture.error_code));
  }
  const std::string exif = ExifBlock(format);
  if (exif.empty()) return Write({picture.bytes.mem, picture.bytes.size}, write);
  return WriteWithExif({picture.bytes.mem, picture.bytes.size}, exif, write);
}

}  // namespace

PictureEncoder OwnPictureEncoder(PictureFileType type) {
  switch (type) {
    case PictureFileType::kPng: return EncodePng;
    case PictureFileType::kJpeg: return EncodeJpeg;
    case PictureFileType::kWebp: return EncodeWebp;
    default: return nullptr;
  }
}

}  // namespace slabstream
