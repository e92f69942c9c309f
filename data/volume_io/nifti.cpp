// NIfTI-1 and NIfTI-2 in one file (.nii, .nii.gz, .nii.bz2) or in a pair (.hdr and .img, each perhaps packed), and Analyze 7.5 in such a
// pair. NIfTI-1 in one file is written.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "data/volume_io/formats.h"
#include "data/volume_io/nifti_header.h"
#include "data/volume_io/output.h"
#include "data/volume_io/stated_field.h"
#include "data/volume_io/text_header.h"

namespace slabstream {
namespace {

constexpr std::int64_t kUsualOffset = kNifti1Bytes + 4;  // header and four bytes that announce extensions

bool IsColour(int data_type) { return data_type == kNiftiRgb || data_type == kNiftiRgba; }

// "32 (complex64)"
std::string TypeText(int data_type) {
  constexpr std::array<std::pair<int, std::string_view>, 5> kOthers = {
      {{1, "bits"}, {32, "complex64"}, {1536, "float128"}, {1792, "complex128"}, {2048, "complex256"}}};
  const auto* const found = std::ranges::find(kOthers, data_type, [](const auto& entry) { return entry.first; });
  return found == kOthers.end() ? std::to_string(data_type) : fmt::format("{} ({})", data_type, found->second);
}

// Sizes are x, y, z, time and channel.
Status SetSizes(const NiftiHeader& fields, const std::string& path, const ReadOptions& options, RawHeader& header) {
  std::vector<double> sizes = fields.sizes;
  while (sizes.size() > 4 && sizes.back() == 1) sizes.pop_back();
  if (sizes.empty() || sizes.size() > 5) {
    const std::int64_t count = sizes.empty() ? fields.dimensions : std::int64_t(sizes.size());
    return Status::InvalidArgument(fmt::format("{}: has {} dimensions, must have 3 to 5: x, y, z, time, channel", path, count));
  }
  const double channels = sizes.size() == 5 ? sizes.back() : 1;
  if (sizes.size() == 5) sizes.pop_back();
  return SetSize(header, path, std::move(sizes), options, channels);
}

// The fourth size may also count frequencies (NIFTI_UNITS_HZ and the two behind it).
TimeAxis TimesOf(const NiftiHeader& fields, std::int64_t count) {
  constexpr std::array<std::string_view, 4> kUnits = {"", "s", "ms", "us"};  // NIFTI_UNITS_UNKNOWN, SEC, MSEC, USEC
  const auto code = std::size_t(fields.time_unit / 8);
  return code < kUnits.size() ? StatedTimes(count, fields.time_step, kUnits[code]) : TimeAxis{.count = int(count)};
}

// From samples to data values. A slope of 0 or that is not finite means that there is none.
Status SetRescale(const NiftiHeader& fields, const std::string& path, RawHeader& header) {
  if (fields.slope == 0 || !std::isfinite(fields.slope) || IsColour(fields.data_type)) return Status::Ok();
  if (!std::isfinite(fields.intercept)) {
    return Status::InvalidArgument(
        fmt::format("{}: scl_inter is {}, must be finite, since scl_slope is {}", path, fields.intercept, fields.slope));
  }
  header.rescale = {fields.slope, fields.intercept};
  if (fields.analyze && fields.slope != 1)
    header.notes.push_back(fmt::format("values are scaled by {:g}, where SPM has a scale factor", fields.slope));
  return Status::Ok();
}

Result<RawHeader> ReadHeader(const NiftiHeader& fields, const std::string& path, const ReadOptions& options) {
  const auto* const type = std::ranges::find(kNiftiTypes, fields.data_type, [](const auto& entry) { return entry.first; });
  if (type == kNiftiTypes.end()) {
    return Status::InvalidArgument(
        fmt::format("{}: {} data type {} is not supported; supported: integers of 8 to 64 bits, floats of 32 and 64 bits, colours", path,
                    fields.version, TypeText(fields.data_type)));
  }
  RawHeader header{.components = fields.data_type == kNiftiRgb ? 3 : fields.data_type == kNiftiRgba ? 4 : 1, .type = type->second};
  if (Status status = SetSizes(fields, path, options, header); !status.ok()) return status;
  header.times = TimesOf(fields, header.times.count);
  constexpr int kLabels = 1002;  // NIFTI_INTENT_LABEL
  header.labels = fields.intent == kLabels;
  if (Status status = PlaceNifti(fields, path, options.matrix, header); !status.ok()) return status;
  if (Status status = SetRescale(fields, path, header); !status.ok()) return status;
  return header;
}

// A path in its parts: "dir/HEAD", ".HDR", ".gz".
struct PathParts {
  std::string stem, ending, packing;
};

PathParts PartsOf(std::string path) {
  PathParts parts;
  for (const std::string_view packing : {".gz", ".bz2"}) {
    if (!ToLower(path).ends_with(packing)) continue;
    parts.packing = path.substr(path.size() - packing.size());
    path.resize(path.size() - packing.size());
  }
  const std::size_t dot = std::min(path.rfind('.'), path.size());
  parts.ending = path.substr(dot);
  parts.stem = path.substr(0, dot);
  return parts;
}

bool IsPairEnding(const std::string& ending) { return ToLower(ending) == ".hdr" || ToLower(ending) == ".img"; }

// The other file of a pair of .hdr and .img, packed or not. None: it is not there.
std::optional<std::string> OtherOfPair(const PathParts& parts) {
  const bool upper = parts.ending == ".HDR" || parts.ending == ".IMG";
  const std::string ending = ToLower(parts.ending) == ".hdr" ? (upper ? ".IMG" : ".img") : (upper ? ".HDR" : ".hdr");
  for (const std::string& packing : {parts.packing, std::string(), std::string(".gz"), std::string(".bz2")}) {
    std::error_code error;
    if (std::string other = parts.stem + ending + packing; std::filesystem::is_regular_file(other, error)) return other;
  }
  return std::nullopt;
}

// The file that begins with the header: `path` unless that is an .img.
std::string HeaderFile(const std::string& path) {
  const PathParts parts = PartsOf(path);
  return ToLower(parts.ending) == ".img" ? OtherOfPair(parts).value_or(path) : path;
}

// None: the file does not begin with the number of such a header.
Result<std::vector<std::byte>> ReadHeaderBytes(const Payload& payload) {
  std::array<std::byte, 4> first{};
  if (Status status = ReadPayload(payload, first, Extent::kStart); !status.ok()) return status;
  std::vector<std::byte> bytes(NiftiHeaderBytes(first));
  if (Status status = ReadPayload(payload, bytes, Extent::kStart); !status.ok()) return status;
  return bytes;
}

Result<LocatedSamples> Locate(const std::string& path, const ReadOptions& options) {
  const auto wrong = [&](const std::string& why) { return Status::InvalidArgument(path + ": " + why); };
  Payload payload{.file = HeaderFile(path)};
  payload.compression = CompressionOf(payload.file);
  const auto bytes = ReadHeaderBytes(payload);
  if (!bytes.ok()) return bytes.status();
  const PathParts parts = PartsOf(payload.file.string());
  const std::optional<NiftiHeader> fields = bytes->empty() ? std::nullopt : ParseNifti(*bytes, !IsPairEnding(parts.ending));
  if (!fields) return wrong("not a NIfTI volume: the header is not that of NIfTI-1 or NIfTI-2");
  Result<RawHeader> header = ReadHeader(*fields, path, options);
  if (!header.ok()) return header.status();

  constexpr double kMostOffset = 0x1p53;
  if (!(fields->vox_offset >= 0 && fields->vox_offset <= kMostOffset)) {
    return wrong(fmt::format("vox_offset is {}, must be in [0, 2^53]", fields->vox_offset));
  }
  payload.big_endian = fields->big_endian;
  auto offset = std::int64_t(fields->vox_offset);
  if (fields->pair) {
    const std::optional<std::string> samples = IsPairEnding(parts.ending) ? OtherOfPair(parts) : std::nullopt;
    if (!samples)
      return wrong(
          fmt::format("its header, of {}, says that the samples are in an .img file beside an .hdr: no such file", fields->version));
    payload.file = *samples;
    payload.compression = CompressionOf(payload.file);
  } else if (const auto header_bytes = std::int64_t(bytes->size()); offset < header_bytes) {
    offset = header_bytes + 4;  // it announces extensions
  }
  payload.Skip(offset);
  return LocatedSamples{*std::move(header), std::move(payload)};
}

// A pair, by its header. Samples of a raw .img may have options.
bool Recognises(const std::string& path, const ReadOptions& options) {
  if (options.dims || !IsPairEnding(PartsOf(path).ending)) return false;
  Payload payload{.file = HeaderFile(path)};
  payload.compression = CompressionOf(payload.file);
  std::array<std::byte, 4> first{};
  return ReadPayload(payload, first, Extent::kStart).ok() && NiftiHeaderBytes(first) > 0;
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
  const auto& [size, spacing, orientation, stretch] = samples.geometry();
  std::string bytes(std::size_t{kUsualOffset}, '\0');
  const auto put = [&]<class T>(std::size_t offset, T value) { std::memcpy(bytes.data() + offset, &value, sizeof value); };
  put(0, kNifti1Bytes);
  put(40, std::int16_t{3});
  for (std::size_t i = 0; i < 7; ++i) {
    put(42 + 2 * i, std::int16_t(i < 3 ? size[int(i)] : 1));
    put(80 + 4 * i, i < 3 ? float(spacing[int(i)]) : 1.0F);
  }
  put(70, std::int16_t(std::ranges::find(kNiftiTypes, samples.type(), [](const auto& entry) { return entry.second; })->first));
  put(72, std::int16_t(8 * BytesPerSample(samples.type())));
  put(76, 1.0F);  // a right-handed quaternion
  put(108, float(kUsualOffset));
  put(112, 1.0F);
  const bool patient = orientation.world == World::kPatient;
  const std::optional<LengthUnit> length = patient && !orientation.unit ? LengthUnit::kMillimetre : orientation.unit;
  const auto* const unit = std::ranges::find(kNiftiUnits, length, &NiftiUnit::unit);
  if (unit != kNiftiUnits.end()) bytes[123] = char(unit->code);
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
          .endings = {".nii", ".nii.gz", ".nii.bz2"},
          .also = "a pair of .hdr and .img files",
          .recognises = Recognises,
          .options = {"time", "channel", "matrix"},
          .locate = Locate,
          .written_endings = {".nii", ".nii.gz"},
          .write = Write,
          .keeps = {.scene = false, .units = {LengthUnit::kMillimetre, LengthUnit::kMicrometre, LengthUnit::kMetre}}};
}

}  // namespace slabstream
