// NIfTI-1 in one file (.nii, .nii.gz). Fields, numbers and formulas are those of nifti1.h, the format's definition.
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <fstream>
#include <optional>

#include "common/volume_io/raw_volume.h"

namespace slabstream {
namespace {

constexpr std::size_t kHeaderBytes = 348;
constexpr std::int64_t kUsualOffset = 352;  // header and four bytes that announce extensions

// The header's bytes in the file's byte order.
class NiftiHeader {
 public:
  explicit NiftiHeader(const std::array<std::byte, kHeaderBytes>& bytes) : bytes_(bytes) {
    swap_ = At<std::int32_t>(0) != std::int32_t{kHeaderBytes};
  }

  bool valid() const { return At<std::int32_t>(0) == std::int32_t{kHeaderBytes} && std::memcmp(bytes_.data() + 344, "n+1", 4) == 0; }
  bool big_endian() const { return swap_ != (std::endian::native == std::endian::big); }
  int dim(int i) const { return At<std::int16_t>(40 + 2 * std::size_t(i)); }
  int data_type() const { return At<std::int16_t>(70); }
  double pixdim(int i) const { return At<float>(76 + 4 * std::size_t(i)); }
  float vox_offset() const { return At<float>(108); }
  float slope() const { return At<float>(112); }
  float intercept() const { return At<float>(116); }
  int space_unit() const { return std::to_integer<int>(bytes_[123]) & 7; }
  int qform_code() const { return At<std::int16_t>(252); }
  int sform_code() const { return At<std::int16_t>(254); }
  double quatern(int i) const { return At<float>(256 + 4 * std::size_t(i)); }  // b, c, d
  double qoffset(int i) const { return At<float>(268 + 4 * std::size_t(i)); }
  double srow(int row, int column) const { return At<float>(280 + 16 * std::size_t(row) + 4 * std::size_t(column)); }

 private:
  template <class T>
  T At(std::size_t offset) const {
    std::array<std::byte, sizeof(T)> field{};
    std::copy_n(bytes_.begin() + std::ptrdiff_t(offset), sizeof(T), field.begin());
    if (swap_) std::reverse(field.begin(), field.end());
    return std::bit_cast<T>(field);
  }

  const std::array<std::byte, kHeaderBytes>& bytes_;
  bool swap_ = false;
};

// NIFTI_TYPE_...
std::optional<SampleType> ToSampleType(int data_type) {
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

// Origin and directions. Like ITK, takes the affine matrix if it leads to the scanner's axes, else the quaternion. Without either they stay
// those of the index axes.
void ReadOrientation(const NiftiHeader& fields, double millimetres, RawHeader& header) {
  constexpr int kScanner = 1;  // NIFTI_XFORM_SCANNER_ANAT
  Vec3 columns[3], origin;
  if (fields.sform_code() == kScanner || (fields.sform_code() > 0 && fields.qform_code() <= 0)) {
    for (int i = 0; i < 3; ++i) columns[i] = {fields.srow(0, i), fields.srow(1, i), fields.srow(2, i)};
    origin = {fields.srow(0, 3), fields.srow(1, 3), fields.srow(2, 3)};
  } else if (fields.qform_code() > 0) {
    const double b = fields.quatern(0), c = fields.quatern(1), d = fields.quatern(2);
    const double a = std::sqrt(std::max(0.0, 1 - (b * b + c * c + d * d)));
    columns[0] = {a * a + b * b - c * c - d * d, 2 * (b * c + a * d), 2 * (b * d - a * c)};
    columns[1] = {2 * (b * c - a * d), a * a + c * c - b * b - d * d, 2 * (c * d + a * b)};
    columns[2] = (fields.pixdim(0) < 0 ? -1.0 : 1.0) * Vec3{2 * (b * d + a * c), 2 * (c * d - a * b), a * a + d * d - b * b - c * c};
    origin = {fields.qoffset(0), fields.qoffset(1), fields.qoffset(2)};
  } else {
    return;
  }
  constexpr Vec3 kLpsFromRas = {-1, -1, 1};
  header.origin = millimetres * (kLpsFromRas * origin);
  for (std::size_t i = 0; i < 3; ++i) {
    if (const Vec3 direction = kLpsFromRas * columns[i]; Length(direction) > 0) header.directions[i] = Normalized(direction);
  }
}

Result<RawHeader> ReadHeader(const NiftiHeader& fields, const std::string& path) {
  const auto wrong = [&](const std::string& why) { return Status::InvalidArgument(path + ": " + why); };
  const std::optional<SampleType> type = ToSampleType(fields.data_type());
  if (!type) {
    return wrong("NIfTI data type " + std::to_string(fields.data_type()) +
                 " is not supported, single integers of 8 to 64 bits and floats of 32 and 64 bits are");
  }
  int dimensions = fields.dim(0);
  if (dimensions < 1 || dimensions > 7) return wrong("has " + std::to_string(dimensions) + " dimensions, must have 3");
  for (int i = 1; i <= dimensions; ++i) {
    if (fields.dim(i) < 1) return wrong("dim[" + std::to_string(i) + "] is " + std::to_string(fields.dim(i)) + ", must be at least 1");
  }
  while (dimensions > 3 && fields.dim(dimensions) == 1) --dimensions;
  if (dimensions != 3) return wrong("has " + std::to_string(dimensions) + " dimensions, must have 3");

  RawHeader header;
  header.type = *type;
  constexpr int kMetres = 1, kMicrometres = 3;  // NIFTI_UNITS_...
  const double millimetres = fields.space_unit() == kMetres ? 1000 : fields.space_unit() == kMicrometres ? 0.001 : 1;
  for (int i = 0; i < 3; ++i) {
    header.size[i] = fields.dim(i + 1);
    header.spacing[i] = millimetres * fields.pixdim(i + 1);
  }
  ReadOrientation(fields, millimetres, header);
  // A slope of 0 means that there is none.
  if (fields.slope() != 0 && std::isfinite(fields.slope()) && std::isfinite(fields.intercept())) {
    header.rescale = {fields.slope(), fields.intercept()};
  }
  return header;
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
  const Result<RawHeader> header = ReadHeader(fields, path);
  if (!header.ok()) return header.status();

  constexpr float kMaxOffset = 1 << 30;  // bytes: floats are exact enough, extensions are smaller
  const float offset = fields.vox_offset();
  if (!(offset <= kMaxOffset)) {
    return Status::InvalidArgument(path + ": vox_offset is " + std::to_string(offset) + ", must be at most 2^30");
  }
  (payload.compressed ? payload.skip : payload.offset) = offset < float{kHeaderBytes} ? kUsualOffset : std::int64_t(offset);
  payload.big_endian = fields.big_endian();
  return ReadSamples(path, *header, payload);
}

}  // namespace slabstream
