// NIfTI-1 in one file (.nii, .nii.gz). Fields, numbers and formulas are those of nifti1.h, the format's definition.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <fstream>
#include <map>
#include <optional>
#include <vector>

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
  bool big_endian() const { return swap_; }
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

std::optional<SampleType> ToSampleType(int data_type) {
  static const std::map<int, const char*> kNames = {{2, "uint8"},  {4, "int16"},    {8, "int32"},    {16, "float32"}, {64, "float64"},
                                                    {256, "int8"}, {512, "uint16"}, {768, "uint32"}, {1024, "int64"}, {1280, "uint64"}};
  const auto found = kNames.find(data_type);  // NIFTI_TYPE_...
  return found == kNames.end() ? std::nullopt : SampleTypeNamed(found->second);
}

// Steps and origin in the patient's space, which is that of NIfTI. Like ITK, takes the affine matrix if it leads to the scanner's axes,
// else the quaternion. Without either, only the spacing is known.
void ReadOrientation(const NiftiHeader& fields, double millimetres, RawHeader& header) {
  constexpr int kScanner = 1;  // NIFTI_XFORM_SCANNER_ANAT
  const Vec3 spacing = millimetres * Vec3{fields.pixdim(1), fields.pixdim(2), fields.pixdim(3)};
  header.steps = StepsOf(spacing);
  if (fields.sform_code() == kScanner || (fields.sform_code() > 0 && fields.qform_code() <= 0)) {
    header.world = World::kPatient;
    header.matrix = "sform";
    for (int i = 0; i < 3; ++i) header.steps[std::size_t(i)] = millimetres * Vec3{fields.srow(0, i), fields.srow(1, i), fields.srow(2, i)};
    header.origin = millimetres * Vec3{fields.srow(0, 3), fields.srow(1, 3), fields.srow(2, 3)};
  } else if (fields.qform_code() > 0) {
    header.world = World::kPatient;
    header.matrix = "qform";
    double b = fields.quatern(0), c = fields.quatern(1), d = fields.quatern(2);
    const double square = b * b + c * c + d * d;  // rounded, it may be above 1
    const double a = std::sqrt(std::max(0.0, 1 - square)), scale = square > 1 ? 1 / std::sqrt(square) : 1;
    b *= scale;
    c *= scale;
    d *= scale;
    header.steps[0] = spacing.x * Vec3{a * a + b * b - c * c - d * d, 2 * (b * c + a * d), 2 * (b * d - a * c)};
    header.steps[1] = spacing.y * Vec3{2 * (b * c - a * d), a * a + c * c - b * b - d * d, 2 * (c * d + a * b)};
    header.steps[2] =
        (fields.pixdim(0) < 0 ? -spacing.z : spacing.z) * Vec3{2 * (b * d + a * c), 2 * (c * d - a * b), a * a + d * d - b * b - c * c};
    header.origin = millimetres * Vec3{fields.qoffset(0), fields.qoffset(1), fields.qoffset(2)};
  }
}

Result<RawHeader> ReadHeader(const NiftiHeader& fields, const std::string& path) {
  const auto wrong = [&](const std::string& why) { return Status::InvalidArgument(path + ": " + why); };
  const std::optional<SampleType> type = ToSampleType(fields.data_type());
  if (!type) {
    return wrong(fmt::format("NIfTI data type {} is not supported, single integers of 8 to 64 bits and floats of 32 and 64 bits are",
                             fields.data_type()));
  }
  const int dimensions = fields.dim(0);
  if (dimensions < 1 || dimensions > 7) return wrong(fmt::format("has {} dimensions, must have 3", dimensions));
  std::vector<double> sizes;
  for (int i = 1; i <= dimensions; ++i) sizes.push_back(fields.dim(i));
  const Result<Index3> size = ToSize(path, sizes);
  if (!size.ok()) return size.status();

  RawHeader header{.size = *size, .type = *type};
  constexpr int kMetres = 1, kMicrometres = 3;  // NIFTI_UNITS_...
  const double millimetres = fields.space_unit() == kMetres ? 1000 : fields.space_unit() == kMicrometres ? 0.001 : 1;
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

Result<RawVolume> ReadNifti(const std::string& path, const ReadOptions& options) {
  Payload payload{.file = path, .compressed = BeginsLikeGzip(path)};
  std::array<std::byte, kHeaderBytes> bytes{};
  if (Status status = ReadPayload(payload, bytes, Extent::kStart); !status.ok()) return status;
  const NiftiHeader fields(bytes);
  if (!fields.valid()) return Status::InvalidArgument(path + ": not a NIfTI volume: the header is not that of NIfTI-1 in one file");
  const Result<RawHeader> header = ReadHeader(fields, path);
  if (!header.ok()) return header.status();

  const float offset = fields.vox_offset();
  // So far floats are exact enough, and extensions are smaller.
  if (!(offset <= 0x1p30F)) return Status::InvalidArgument(fmt::format("{}: vox_offset is {}, must be at most 2^30", path, offset));
  (payload.compressed ? payload.skip : payload.offset) = offset < float{kHeaderBytes} ? kUsualOffset : std::int64_t(offset);
  payload.big_endian = fields.big_endian();
  return ReadSamples(path, *header, payload, options);
}

}  // namespace slabstream
