// NIfTI-1 in one file (.nii, .nii.gz). ITK reads the geometry. Sample type, rescale and place of the samples come from the header's own
// fields, because ITK turns samples with a rescale slope into floats, which would lose the integers.
#include <itkNiftiImageIO.h>
#include <nifti1_io.h>

#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <fstream>
#include <optional>

#include "common/volume_io/itk_header.h"
#include "common/volume_io/raw_volume.h"

namespace slabstream {
namespace {

constexpr std::size_t kHeaderBytes = 348;
constexpr std::int64_t kUsualOffset = 352;  // header and four bytes that announce extensions

// Bytes of the header by their places in nifti1.h, in the file's byte order.
class NiftiHeader {
 public:
  explicit NiftiHeader(const std::array<std::byte, kHeaderBytes>& bytes) : bytes_(bytes) {
    const bool native = At<std::int32_t>(0) == std::int32_t{kHeaderBytes};
    swap_ = !native;
    big_endian_ = native == (std::endian::native == std::endian::big);
  }

  bool valid() const { return At<std::int32_t>(0) == std::int32_t{kHeaderBytes} && std::memcmp(bytes_.data() + 344, "n+1", 4) == 0; }
  bool big_endian() const { return big_endian_; }
  std::int16_t dimensions() const { return At<std::int16_t>(40); }
  std::int16_t side(std::int16_t dimension) const { return At<std::int16_t>(40 + 2 * std::size_t(dimension)); }  // from 1
  std::int16_t data_type() const { return At<std::int16_t>(70); }
  float voxel_offset() const { return At<float>(108); }
  float slope() const { return At<float>(112); }
  float intercept() const { return At<float>(116); }

 private:
  template <class T>
  T At(std::size_t offset) const {
    std::array<std::byte, sizeof(T)> field{};
    std::copy_n(bytes_.begin() + std::ptrdiff_t(offset), sizeof(T), field.begin());
    if (swap_) std::reverse(field.begin(), field.end());
    return std::bit_cast<T>(field);
  }

  const std::array<std::byte, kHeaderBytes>& bytes_;
  bool swap_ = false, big_endian_ = false;
};

// NIFTI_TYPE_... of nifti1.h.
std::optional<SampleType> ToSampleType(std::int16_t data_type) {
  switch (data_type) {
    case 2: return SampleType::kUint8;
    case 4: return SampleType::kInt16;
    case 8: return SampleType::kInt32;
    case 16: return SampleType::kFloat32;
    case 64: return SampleType::kFloat64;
    case 256: return SampleType::kInt8;
    case 512: return SampleType::kUint16;
    case 768: return SampleType::kUint32;
    case 1024: return SampleType::kInt64;
    case 1280: return SampleType::kUint64;
    default: return std::nullopt;
  }
}

// Before ITK's parser, which would print what is wrong with them.
Status CheckDimensions(const NiftiHeader& fields, const std::string& path) {
  constexpr std::int16_t kMaxDimensions = 7;
  if (fields.dimensions() < 1 || fields.dimensions() > kMaxDimensions) {
    return Status::InvalidArgument(path + ": has " + std::to_string(fields.dimensions()) + " dimensions, must have 3");
  }
  for (std::int16_t i = 1; i <= fields.dimensions(); ++i) {
    if (fields.side(i) < 1) {
      return Status::InvalidArgument(path + ": dim[" + std::to_string(i) + "] is " + std::to_string(fields.side(i)) +
                                     ", must be at least 1");
    }
  }
  return Status::Ok();
}

bool BeginsLikeGzip(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return file.get() == 0x1f && file.get() == 0x8b;
}

}  // namespace

Result<RawVolume> ReadNifti(const std::string& path) {
  Payload payload{.file = path, .compressed = BeginsLikeGzip(path)};
  std::array<std::byte, kHeaderBytes> bytes{};
  if (Status status = ReadPayloadStart(payload, bytes); !status.ok()) return status;
  const NiftiHeader fields(bytes);
  if (!fields.valid()) return Status::InvalidArgument(path + ": not a NIfTI volume: the header is not that of NIfTI-1 in one file");
  const std::optional<SampleType> type = ToSampleType(fields.data_type());
  if (!type) {
    return Status::InvalidArgument(path + ": NIfTI data type " + std::to_string(fields.data_type()) +
                                   " is not supported, single integers of 8 to 64 bits and floats of 32 and 64 bits are");
  }

  if (Status status = CheckDimensions(fields, path); !status.ok()) return status;

  nifti_set_debug_level(0);  // what is wrong is reported as a Status, not on stderr
  auto io = itk::NiftiImageIO::New();
  Result<RawHeader> header = ReadItkHeader(*io, path, "NIfTI");
  if (!header.ok()) return header.status();
  header->type = *type;
  const float slope = fields.slope(), intercept = fields.intercept();
  // A slope of 0 says that there is none (nifti1.h).
  if (slope != 0 && std::isfinite(slope) && std::isfinite(intercept)) header->rescale = {slope, intercept};

  constexpr float kMaxOffset = 1 << 30;  // bytes: floats are exact enough, extensions are smaller
  const float offset = fields.voxel_offset();
  if (!(offset <= kMaxOffset))
    return Status::InvalidArgument(path + ": vox_offset is " + std::to_string(offset) + ", must be at most 2^30");
  const std::int64_t samples_at = offset < float{kHeaderBytes} ? kUsualOffset : std::int64_t(offset);
  (payload.compressed ? payload.skip : payload.offset) = samples_at;
  payload.big_endian = fields.big_endian();
  return ReadSamples(path, *header, payload);
}

}  // namespace slabstream
