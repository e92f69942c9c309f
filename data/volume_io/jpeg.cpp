// A folder of numbered JPEG pictures, one a slice, through libjpeg. JPEG rounds values, so such files are for looking at, not for
// measuring.
#include <cstdio>
#include <string>
#include <utility>

#include "common/volume/memory_budget.h"
#include "data/volume_io/jpeg_picture.h"
#include "data/volume_io/slice_stack.h"

namespace slabstream {
namespace {

class JpegFile : public SliceFile {
 public:
  static constexpr std::string_view kFormat = "JPEG";

  explicit JpegFile(std::string path) : path_(std::move(path)), file_(std::fopen(path_.c_str(), "rb")) {}

  Status Open() {
    if (file_ == nullptr) return Status::NotFound(path_ + ": cannot be opened for reading");
    return picture_.Begin(file_.get()) ? Status::Ok() : Failed(StatusCode::kInvalidArgument, "not a JPEG picture");
  }

  Result<RawHeader> ReadHeader() override {
    const int components = picture_.components();
    if (components != 1 && components != 3) {
      return Status::InvalidArgument(path_ + ": a picture of " + std::to_string(components) + " components, must be grey or RGB");
    }
    RawHeader header{.components = components, .type = SampleType::kUint8};
    const std::vector<double> sizes = {double(picture_.width()), double(picture_.height()), 1};
    if (Status status = SetSize(header, path_, sizes, {}); !status.ok()) return status;
    return header;
  }

  Status ReadSamples(const RawHeader& header, std::byte* out) override {
    // libjpeg keeps the coefficients of a picture in several scans, two bytes a sample.
    if (picture_.has_multiple_scans()) {
      if (Status status = CheckFitsMemory(2 * header.sample_bytes(), path_); !status.ok()) return status;
    }
    const bool whole = picture_.ReadRows(reinterpret_cast<JSAMPLE*>(out));
    return whole ? Status::Ok() : Failed(StatusCode::kDataLoss, "truncated or damaged");
  }

 private:
  Status Failed(StatusCode code, const std::string& why) const { return PictureFailure(code, path_, why, picture_.complaint()); }

  const std::string path_;
  const PictureHandle file_;
  JpegPicture picture_;
};

}  // namespace

VolumeFormat Jpeg() { return StackFormat<JpegFile>(); }

}  // namespace slabstream
