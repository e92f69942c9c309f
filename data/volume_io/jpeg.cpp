// A folder of numbered JPEG pictures, one a slice, through libjpeg. JPEG rounds values, so such files are for looking at, not for
// measuring.
#include <cstdio>
// jpeglib.h needs the types of stdio.h before it.
#include <jpeglib.h>

#include <array>
#include <csetjmp>
#include <memory>
#include <string>
#include <utility>

#include "common/volume/memory_budget.h"
#include "data/volume_io/slice_stack.h"

namespace slabstream {
namespace {

// libjpeg leaves by longjmp, so no function that calls it behind setjmp has objects with destructors.
class JpegFile : public SliceFile {
 public:
  static constexpr std::string_view kFormat = "JPEG";

  explicit JpegFile(std::string path) : path_(std::move(path)), file_(std::fopen(path_.c_str(), "rb")) {
    jpeg_.err = jpeg_std_error(&errors_);
    jpeg_.client_data = this;
    errors_.error_exit = OnError;
    errors_.output_message = [](j_common_ptr) {};
  }
  ~JpegFile() override { jpeg_destroy_decompress(&jpeg_); }
  JpegFile(const JpegFile&) = delete;
  JpegFile& operator=(const JpegFile&) = delete;

  Status Open() {
    if (file_ == nullptr) return Status::NotFound(path_ + ": cannot be opened for reading");
    return Begin() ? Status::Ok() : Failed(StatusCode::kInvalidArgument, "not a JPEG picture");
  }

  Result<RawHeader> ReadHeader() override {
    if (jpeg_.num_components != 1 && jpeg_.num_components != 3) {
      return Status::InvalidArgument(path_ + ": a picture of " + std::to_string(jpeg_.num_components) + " components, must be grey or RGB");
    }
    RawHeader header{.components = jpeg_.num_components, .type = SampleType::kUint8};
    const double width = jpeg_.image_width, height = jpeg_.image_height;
    if (Status status = SetSize(header, path_, {width, height, 1}, {}); !status.ok()) return status;
    return header;
  }

  Status ReadSamples(const RawHeader& header, std::byte* out) override {
    // libjpeg keeps the coefficients of a picture in several scans, two bytes a sample.
    if (jpeg_has_multiple_scans(&jpeg_) != 0) {
      if (Status status = CheckFitsMemory(2 * header.sample_bytes(), path_); !status.ok()) return status;
    }
    // It fills up what is missing, and only warns.
    if (!ReadRows(header, reinterpret_cast<JSAMPLE*>(out)) || errors_.num_warnings > 0) {
      return Failed(StatusCode::kDataLoss, "truncated or damaged");
    }
    return Status::Ok();
  }

 private:
  static void OnError(j_common_ptr jpeg) {
    auto& file = *static_cast<JpegFile*>(jpeg->client_data);
    (*jpeg->err->format_message)(jpeg, file.complaint_.data());
    std::longjmp(file.jump_, 1);
  }

  Status Failed(StatusCode code, const std::string& why) const {
    return {code, path_ + ": " + why + (complaint_[0] == '\0' ? "" : std::string(": ") + complaint_.data())};
  }

  // A picture with thousands of scans would take hours.
  static void OnProgress(j_common_ptr jpeg) {
    constexpr int kMostScans = 200;
    if (reinterpret_cast<j_decompress_ptr>(jpeg)->input_scan_number <= kMostScans) return;
    auto& file = *static_cast<JpegFile*>(jpeg->client_data);
    std::snprintf(file.complaint_.data(), file.complaint_.size(), "more than %d scans", kMostScans);
    std::longjmp(file.jump_, 1);
  }

  bool Begin() {
    if (setjmp(jump_) != 0) return false;
    jpeg_create_decompress(&jpeg_);
    jpeg_.progress = &progress_;
    jpeg_stdio_src(&jpeg_, file_.get());
    (void)jpeg_read_header(&jpeg_, TRUE);
    return true;
  }

  bool ReadRows(const RawHeader& header, JSAMPLE* out) {
    if (setjmp(jump_) != 0) return false;
    jpeg_.out_color_space = header.components == 1 ? JCS_GRAYSCALE : JCS_RGB;
    (void)jpeg_start_decompress(&jpeg_);
    while (jpeg_.output_scanline < jpeg_.output_height) {
      JSAMPROW row = out + std::size_t(jpeg_.output_scanline) * std::size_t(header.size.x) * std::size_t(header.components);
      (void)jpeg_read_scanlines(&jpeg_, &row, 1);
    }
    (void)jpeg_finish_decompress(&jpeg_);
    return true;
  }

  struct Close {
    void operator()(std::FILE* file) const { (void)std::fclose(file); }
  };
  std::string path_;
  std::unique_ptr<std::FILE, Close> file_;
  jpeg_decompress_struct jpeg_{};
  jpeg_error_mgr errors_{};
  jpeg_progress_mgr progress_{.progress_monitor = OnProgress};
  std::jmp_buf jump_{};
  std::array<char, JMSG_LENGTH_MAX> complaint_{};
};

}  // namespace

VolumeFormat Jpeg() { return StackFormat<JpegFile>(); }

}  // namespace slabstream
