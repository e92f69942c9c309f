// A folder of numbered PNG pictures, one a slice, through libpng. Palettes become red, green and blue; samples of 1, 2 and 4 bits keep
// their values, as bytes.
#include <png.h>

#include <array>
#include <bit>
#include <csetjmp>
#include <cstdio>
#include <new>
#include <string>
#include <utility>

#include "data/volume_io/slice_stack.h"

namespace slabstream {
namespace {

// libpng leaves by longjmp, so no function that calls it behind setjmp has objects with destructors.
class PngFile : public SliceFile {
 public:
  static constexpr std::string_view kFormat = "PNG";

  explicit PngFile(std::string path) : path_(std::move(path)), file_(std::fopen(path_.c_str(), "rb")) {
    png_ = png_create_read_struct(PNG_LIBPNG_VER_STRING, this, OnError, [](png_structp, png_const_charp) {});
    if (png_ != nullptr) info_ = png_create_info_struct(png_);
  }
  ~PngFile() override { png_destroy_read_struct(&png_, &info_, nullptr); }
  PngFile(const PngFile&) = delete;
  PngFile& operator=(const PngFile&) = delete;

  Status Open() {
    if (file_ == nullptr) return Status::NotFound(path_ + ": cannot be opened for reading");
    if (info_ == nullptr) throw std::bad_alloc();
    return Begin() ? Status::Ok() : Failed(StatusCode::kInvalidArgument, "not a PNG picture");
  }

  Result<RawHeader> ReadHeader() override {
    const int kind = png_get_color_type(png_, info_), bits = png_get_bit_depth(png_, info_);
    const bool colour = (kind & PNG_COLOR_MASK_COLOR) != 0, alpha = (kind & PNG_COLOR_MASK_ALPHA) != 0;
    RawHeader header{.components = (colour ? 3 : 1) + (alpha ? 1 : 0), .type = bits == 16 ? SampleType::kUint16 : SampleType::kUint8};
    const double width = png_get_image_width(png_, info_), height = png_get_image_height(png_, info_);
    if (Status status = SetSize(header, path_, {width, height, 1}, {}); !status.ok()) return status;
    return header;
  }

  Status ReadSamples(const RawHeader& header, std::byte* out) override {
    const std::size_t row_bytes = std::size_t(header.size.x) * std::size_t(header.components) * BytesPerSample(header.type);
    if (PrepareRows() != row_bytes) return Failed(StatusCode::kDataLoss, "truncated or damaged");
    std::vector<png_bytep> rows;
    for (std::int32_t y = 0; y < header.size.y; ++y) rows.push_back(reinterpret_cast<png_bytep>(out) + std::size_t(y) * row_bytes);
    return ReadRows(rows.data()) ? Status::Ok() : Failed(StatusCode::kDataLoss, "truncated or damaged");
  }

 private:
  static void OnError(png_structp png, png_const_charp why) {
    auto& file = *static_cast<PngFile*>(png_get_error_ptr(png));
    std::snprintf(file.complaint_.data(), file.complaint_.size(), "%s", why);
    std::longjmp(file.jump_, 1);
  }

  Status Failed(StatusCode code, const std::string& why) const { return PictureFailure(code, path_, why, complaint_.data()); }

  bool Begin() {
    if (setjmp(jump_) != 0) return false;
    constexpr png_uint_32 kMostBytes = 1 << 20;  // of a chunk of text
    png_set_user_limits(png_, kMaxVolumeSide, kMaxVolumeSide);
    png_set_chunk_malloc_max(png_, kMostBytes);
    png_init_io(png_, file_.get());
    png_read_info(png_, info_);
    return true;
  }

  // The bytes of a row; 0: it cannot be told.
  std::size_t PrepareRows() {
    if (setjmp(jump_) != 0) return 0;
    png_set_packing(png_);  // a byte for each sample
    if (png_get_color_type(png_, info_) == PNG_COLOR_TYPE_PALETTE) {
      png_set_palette_to_rgb(png_);
      png_set_strip_alpha(png_);
    }
    static_assert(std::endian::native == std::endian::little, "PNG is big endian");
    png_set_swap(png_);
    png_set_interlace_handling(png_);
    png_read_update_info(png_, info_);
    return png_get_rowbytes(png_, info_);
  }

  // To the end of the file, so that checksums are verified.
  bool ReadRows(png_bytepp rows) {
    if (setjmp(jump_) != 0) return false;
    png_read_image(png_, rows);
    png_read_end(png_, nullptr);
    return true;
  }

  std::string path_;
  PictureHandle file_;
  png_structp png_ = nullptr;
  png_infop info_ = nullptr;
  std::jmp_buf jump_{};
  std::array<char, 128> complaint_{};
};

}  // namespace

VolumeFormat Png() { return StackFormat<PngFile>(); }

}  // namespace slabstream
