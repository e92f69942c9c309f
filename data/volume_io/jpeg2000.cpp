// A folder of numbered JPEG 2000 pictures, one a slice, through OpenJPEG: in a JP2 file, or the bare code stream. Samples keep their
// values: those of 10 or 12 bits are not stretched.
#include <fmt/format.h>
#include <openjpeg.h>

#include <array>
#include <fstream>
#include <memory>
#include <string>

#include "common/volume/memory_budget.h"
#include "data/volume_io/slice_stack.h"

namespace slabstream {
namespace {

class Jpeg2000File : public SliceFile {
 public:
  static constexpr std::string_view kFormat = "JPEG 2000";

  explicit Jpeg2000File(std::string path) : path_(std::move(path)) {}

  Status Open() {
    std::array<unsigned char, 4> start{};
    std::ifstream file(path_, std::ios::binary);
    if (!file) return Status::NotFound(path_ + ": cannot be opened for reading");
    (void)file.read(reinterpret_cast<char*>(start.data()), std::streamsize(start.size()));
    const bool bare = start == std::array<unsigned char, 4>{0xff, 0x4f, 0xff, 0x51};
    codec_.reset(opj_create_decompress(bare ? OPJ_CODEC_J2K : OPJ_CODEC_JP2));
    stream_.reset(opj_stream_create_default_file_stream(path_.c_str(), OPJ_TRUE));
    opj_dparameters_t parameters;
    opj_set_default_decoder_parameters(&parameters);
    opj_image_t* image = nullptr;
    const bool read = codec_ != nullptr && stream_ != nullptr && opj_set_error_handler(codec_.get(), KeepFirst, &complaint_) != 0 &&
                      opj_setup_decoder(codec_.get(), &parameters) != 0 && opj_decoder_set_strict_mode(codec_.get(), OPJ_TRUE) != 0 &&
                      opj_read_header(stream_.get(), codec_.get(), &image) != 0;
    image_.reset(image);
    return read ? Status::Ok() : Failed(StatusCode::kInvalidArgument, "not a JPEG 2000 picture");
  }

  Result<RawHeader> ReadHeader() override {
    const opj_image_comp_t& first = image_->comps[0];
    for (std::uint32_t i = 1; i < image_->numcomps; ++i) {
      const opj_image_comp_t& other = image_->comps[i];
      if (other.w == first.w && other.h == first.h && other.prec == first.prec && other.sgnd == first.sgnd) continue;
      return Status::InvalidArgument(path_ + ": components of different sizes or types are not supported");
    }
    if (image_->numcomps > std::uint32_t{kMaxComponents} || first.prec > 16) {
      return Status::InvalidArgument(fmt::format("{}: {} components of {} bits, must be at most {} of at most 16 bits", path_,
                                                 image_->numcomps, first.prec, kMaxComponents));
    }
    if (image_->color_space == OPJ_CLRSPC_SYCC || image_->color_space == OPJ_CLRSPC_EYCC) {
      return Status::InvalidArgument(path_ + ": a colour image in YCbCr is not supported, must be grey or RGB");
    }
    const bool is_signed = first.sgnd != 0, small = first.prec <= 8;
    RawHeader header{.components = int(image_->numcomps),
                     .type = is_signed ? (small ? SampleType::kInt8 : SampleType::kInt16)
                             : small   ? SampleType::kUint8
                                       : SampleType::kUint16};
    if (Status status = SetSize(header, path_, {double(first.w), double(first.h), 1}, {}); !status.ok()) return status;
    return header;
  }

  Status ReadSamples(const RawHeader& header, std::byte* out) override {
    // OpenJPEG decodes into 32 bits a sample, and keeps a copy of coefficients.
    const std::int64_t samples = header.sample_bytes() / std::int64_t(BytesPerSample(header.type));
    if (Status status = CheckFitsMemory(samples * 2 * std::int64_t(sizeof(OPJ_INT32)), path_); !status.ok()) return status;
    const bool decoded = opj_decode(codec_.get(), stream_.get(), image_.get()) != 0 && opj_end_decompress(codec_.get(), stream_.get()) != 0;
    for (int c = 0; c < header.components; ++c) {
      const opj_image_comp_t& component = image_->comps[c];
      const bool whole = decoded && component.data != nullptr && component.w == std::uint32_t(header.size.x) &&
                         component.h == std::uint32_t(header.size.y);
      if (!whole) return Failed(StatusCode::kDataLoss, "truncated or damaged");
      VisitSampleType(header.type, [&]<class T>(const T*) {
        T* to = reinterpret_cast<T*>(out) + c;
        for (std::int64_t i = 0; i < samples / header.components; ++i) to[i * header.components] = T(double(component.data[i]));
      });
    }
    return Status::Ok();
  }

 private:
  static void KeepFirst(const char* why, void* complaint) {
    std::string& text = *static_cast<std::string*>(complaint);
    if (text.empty()) text.assign(why, std::string_view(why).find_last_not_of('\n') + 1);
  }
  Status Failed(StatusCode code, const std::string& why) const { return PictureFailure(code, path_, why, complaint_); }

  template <auto kDestroy>
  struct Destroy {  // OpenJPEG's handles are pointers to nothing, all of the same type
    template <class T>
    void operator()(T* handle) const {
      kDestroy(handle);
    }
  };
  const std::string path_;
  std::string complaint_;
  std::unique_ptr<void*, Destroy<opj_destroy_codec>> codec_;
  std::unique_ptr<void*, Destroy<opj_stream_destroy>> stream_;
  std::unique_ptr<opj_image_t, Destroy<opj_image_destroy>> image_;
};

}  // namespace

VolumeFormat Jpeg2000() { return StackFormat<Jpeg2000File>(); }

}  // namespace slabstream
