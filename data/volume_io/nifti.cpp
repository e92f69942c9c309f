// NIfTI-1 in one file (.nii, .nii.gz). Fields, numbers and formulas are those of nifti1.h, the format's definition.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "data/volume_io/binary_header.h"
#include "data/volume_io/formats.h"
#include "data/volume_io/output.h"

namespace slabstream {
namespace {

constexpr std::size_t kHeaderBytes = 348;
constexpr std::int64_t kUsualOffset = 352;  // header and four bytes that announce extensions

// The header's bytes in the file's byte order.
class NiftiHeader {
 public:
  explicit NiftiHeader(const std::array<std::byte, kHeaderBytes>& bytes)
      : bytes_(bytes),
        big_endian_(BinaryHeader(bytes, false).At<std::int32_t>(0) != std::int32_t{kHeaderBytes}),
        fields_(bytes, big_endian_) {}

  bool valid() const { return At<std::int32_t>(0) == std::int32_t{kHeaderBytes} && std::memcmp(bytes_.data() + 344, "n+1", 4) == 0; }
  bool big_endian() const { return big_endian_; }
  int dim(int i) const { return At<std::int16_t>(40 + 2 * std::size_t(i)); }
  int intent_code() const { return At<std::int16_t>(68); }
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
    return fields_.At<T>(offset);
  }

  const std::array<std::byte, kHeaderBytes>& bytes_;
  bool big_endian_;
  BinaryHeader fields_;
};

constexpr int kRgb = 128, kRgba = 2304;  // NIFTI_TYPE_RGB24, NIFTI_TYPE_RGBA32

// NIFTI_TYPE_... The first number of a type is the one that is written.
constexpr std::array<std::pair<int, SampleType>, 12> kTypes = {{{2, SampleType::kUint8},
                                                                {4, SampleType::kInt16},
                                                                {8, SampleType::kInt32},
                                                                {16, SampleType::kFloat32},
                                                                {64, SampleType::kFloat64},
                                                                {256, SampleType::kInt8},
                                                                {512, SampleType::kUint16},
                                                                {768, SampleType::kUint32},
                                                                {1024, SampleType::kInt64},
                                                                {1280, SampleType::kUint64},
                                                                {kRgb, SampleType::kUint8},
                                                                {kRgba, SampleType::kUint8}}};

std::optional<SampleType> ToSampleType(int data_type) {
  const auto* const found = std::ranges::find(kTypes, data_type, [](const auto& entry) { return entry.first; });
  return found == kTypes.end() ? std::nullopt : std::optional(found->second);
}

// NIFTI_UNITS_...
struct Unit {
  int code;
  LengthUnit unit;
  double millimetres;
};
constexpr std::array<Unit, 3> kUnits = {
    {{1, LengthUnit::kMetre, 1000}, {2, LengthUnit::kMillimetre, 1}, {3, LengthUnit::kMicrometre, 0.001}}};

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

Result<RawHeader> ReadHeader(const NiftiHeader& fields, const std::string& path, const ReadOptions& options) {
  const auto wrong = [&](const std::string& why) { return Status::InvalidArgument(path + ": " + why); };
  const std::optional<SampleType> type = ToSampleType(fields.data_type());
  if (!type) {
    return wrong(fmt::format("NIfTI data type {} is not supported; supported: integers of 8 to 64 bits, floats of 32 and 64 bits, colours",
                             fields.data_type()));
  }
  const int dimensions = fields.dim(0);
  if (dimensions < 1 || dimensions > 7) return wrong(fmt::format("has {} dimensions, must have 3", dimensions));
  std::vector<double> sizes;
  for (int i = 1; i <= dimensions; ++i) sizes.push_back(fields.dim(i));
  RawHeader header{.components = fields.data_type() == kRgb ? 3 : fields.data_type() == kRgba ? 4 : 1, .type = *type};
  if (Status status = SetSize(header, path, std::move(sizes), options); !status.ok()) return status;
  constexpr int kLabels = 1002;  // NIFTI_INTENT_LABEL
  header.labels = fields.intent_code() == kLabels;
  const auto* const unit = std::ranges::find(kUnits, fields.space_unit(), &Unit::code);
  ReadOrientation(fields, unit == kUnits.end() ? 1 : unit->millimetres, header);
  if (unit != kUnits.end()) header.unit = LengthUnit::kMillimetre;
  // A slope of 0 means that there is none.
  if (fields.slope() != 0 && std::isfinite(fields.slope()) && std::isfinite(fields.intercept())) {
    header.rescale = {fields.slope(), fields.intercept()};
  }
  return header;
}

Result<LocatedSamples> Locate(const std::string& path, const ReadOptions& options) {
  Payload payload{.file = path, .compressed = BeginsLikeGzip(path)};
  std::array<std::byte, kHeaderBytes> bytes{};
  if (Status status = ReadPayload(payload, bytes, Extent::kStart); !status.ok()) return status;
  const NiftiHeader fields(bytes);
  if (!fields.valid()) return Status::InvalidArgument(path + ": not a NIfTI volume: the header is not that of NIfTI-1 in one file");
  Result<RawHeader> header = ReadHeader(fields, path, options);
  if (!header.ok()) return header.status();

  const float offset = fields.vox_offset();
  // So far floats are exact enough, and extensions are smaller.
  if (!(offset <= 0x1p30F)) return Status::InvalidArgument(fmt::format("{}: vox_offset is {}, must be at most 2^30", path, offset));
  (payload.compressed ? payload.skip : payload.offset) = offset < float{kHeaderBytes} ? kUsualOffset : std::int64_t(offset);
  payload.big_endian = fields.big_endian();
  return LocatedSamples{*std::move(header), std::move(payload)};
}

// The rotation whose columns are the axes, as b, c and d of a quaternion a + bi + cj + dk with a >= 0.
std::array<double, 3> QuaternionOf(const std::array<Vec3, 3>& axes) {
  const auto& [x, y, z] = axes;
  // Of the four ways to compute it, the one that divides by the largest number.
  const std::array<double, 4> squares = {1 + x.x + y.y + z.z, 1 + x.x - y.y - z.z, 1 - x.x + y.y - z.z, 1 - x.x - y.y + z.z};
  const auto largest = std::ranges::max_element(squares) - squares.begin();
  const double twice = std::sqrt(std::max(squares[std::size_t(largest)], 0.0));  // of the largest of a, b, c, d
  const double i = y.z - z.y, j = z.x - x.z, k = x.y - y.x, xy = x.y + y.x, xz = z.x + x.z, yz = y.z + z.y;
  std::array<double, 4> all{};
  switch (largest) {
    case 0: all = {twice * twice, i, j, k}; break;
    case 1: all = {i, twice * twice, xy, xz}; break;
    case 2: all = {j, xy, twice * twice, yz}; break;
    default: all = {k, xz, yz, twice * twice}; break;
  }
  const double scale = (all[0] < 0 ? -0.5 : 0.5) / twice;
  return {scale * all[1], scale * all[2], scale * all[3]};
}

std::string HeaderOf(const FileSamples& samples) {
  const auto& [size, spacing, orientation] = samples.geometry();
  std::string bytes(std::size_t{kUsualOffset}, '\0');
  const auto put = [&]<class T>(std::size_t offset, T value) { std::memcpy(bytes.data() + offset, &value, sizeof value); };
  put(0, std::int32_t{kHeaderBytes});
  put(40, std::int16_t{3});
  for (std::size_t i = 0; i < 7; ++i) {
    put(42 + 2 * i, std::int16_t(i < 3 ? size[int(i)] : 1));
    put(80 + 4 * i, i < 3 ? float(spacing[int(i)]) : 1.0F);
  }
  put(70, std::int16_t(std::ranges::find(kTypes, samples.type(), [](const auto& entry) { return entry.second; })->first));
  put(72, std::int16_t(8 * BytesPerSample(samples.type())));
  put(76, 1.0F);  // a right-handed quaternion
  put(108, float(kUsualOffset));
  put(112, 1.0F);
  const bool patient = orientation.world == World::kPatient;
  const std::optional<LengthUnit> length = patient && !orientation.unit ? LengthUnit::kMillimetre : orientation.unit;
  const auto* const unit = std::ranges::find(kUnits, length, &Unit::unit);
  if (unit != kUnits.end()) bytes[123] = char(unit->code);
  if (orientation.world != World::kVoxels) {
    constexpr std::int16_t kScannerAxes = 1, kOtherAxes = 2;
    for (const std::size_t code : {252, 254}) put(code, patient ? kScannerAxes : kOtherAxes);
    const std::array<double, 3> quaternion = QuaternionOf(orientation.axes);
    for (int row = 0; row < 3; ++row) {
      put(256 + 4 * std::size_t(row), float(quaternion[std::size_t(row)]));
      put(268 + 4 * std::size_t(row), float(orientation.origin[row]));
      for (std::size_t i = 0; i < 3; ++i) {
        put(280 + 16 * std::size_t(row) + 4 * i, float(spacing[int(i)] * orientation.axes[i][row]));
      }
      put(292 + 16 * std::size_t(row), float(orientation.origin[row]));
    }
  }
  std::memcpy(bytes.data() + 344, "n+1", 4);
  return bytes;
}

Status Write(const FileSamples& samples, const std::string& path) {
  const VolumeGeometry& geometry = samples.geometry();
  for (const Axis axis : kAxes) {
    const auto wrong = [&](const std::string& why) {
      return Status::InvalidArgument(fmt::format("{}: {} along {}", path, why, Letter(axis)));
    };
    constexpr std::int32_t kMost = 32767;
    if (geometry.size[axis] > kMost) {
      return wrong(fmt::format("NIfTI-1 holds at most {} voxels, but there are {}", kMost, geometry.size[axis]));
    }
    const auto spacing = float(geometry.spacing[axis]), origin = float(geometry.orientation.origin[axis]);
    if (!(spacing >= std::numeric_limits<float>::min()) || !std::isfinite(spacing) || !std::isfinite(origin)) {
      return wrong(fmt::format("NIfTI-1 has floats, which do not hold the spacing {} or the origin {}", geometry.spacing[axis],
                               geometry.orientation.origin[axis]));
    }
  }
  return WriteHeaderAndSamples(path, HeaderOf(samples), samples,
                               path.ends_with("z") || path.ends_with("Z") ? Gzipped::kAll : Gzipped::kNothing);
}

}  // namespace

VolumeFormat Nifti() {
  return {.name = "NIfTI",
          .endings = {".nii", ".nii.gz"},
          .options = {"time", "channel"},
          .locate = Locate,
          .written_endings = {".nii", ".nii.gz"},
          .write = Write,
          .keeps = {.scene = false, .units = {LengthUnit::kMillimetre, LengthUnit::kMicrometre, LengthUnit::kMetre}}};
}

}  // namespace slabstream
