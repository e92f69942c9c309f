// MRC and CCP4 maps of electron microscopy and crystallography (.mrc, .mrcs, .map, .ccp4, .rec, .st, .ali; .gz or .bz2 of .mrc and .map).
// Fields and numbers are those of the MRC2014 format (Cheng et al. 2015), which counts in words of four bytes from 1.
#include <fmt/format.h>

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <optional>

#include "data/volume_io/binary_header.h"
#include "data/volume_io/formats.h"

namespace slabstream {
namespace {

constexpr std::size_t kHeaderBytes = 1024;

constexpr std::size_t Word(int number) { return 4 * std::size_t(number - 1); }

// By the machine stamp; if that is neither of the two, by the mode, which is a small number.
bool IsBigEndian(std::span<const std::byte> bytes) {
  constexpr std::int32_t kMostMode = 255;
  const auto stamp = std::to_integer<int>(bytes[Word(54)]);
  if (stamp == 0x11 || stamp == 0x44) return stamp == 0x11;
  const auto mode = BinaryHeader(bytes, false).At<std::int32_t>(Word(4));
  return mode < 0 || mode > kMostMode;
}

// "101 (integers of 4 bits)"
std::string ModeText(std::int32_t mode) {
  switch (mode) {
    case 3: return "3 (complex integers)";
    case 4: return "4 (complex floats)";
    case 16: return "16 (colours)";
    case 101: return "101 (integers of 4 bits)";
    default: return std::to_string(mode);
  }
}

std::optional<SampleType> TypeOf(const BinaryHeader& fields) {
  constexpr std::int32_t kImodStamp = 1146047817, kSignedBytes = 1;
  // IMOD wrote unsigned bytes, and marks files whose bytes are signed.
  const bool imod = fields.At<std::int32_t>(Word(39)) == kImodStamp, is_signed = (fields.At<std::int32_t>(Word(40)) & kSignedBytes) != 0;
  switch (fields.At<std::int32_t>(Word(4))) {
    case 0: return imod && !is_signed ? SampleType::kUint8 : SampleType::kInt8;
    case 1: return SampleType::kInt16;
    case 2: return SampleType::kFloat32;
    case 6: return SampleType::kUint16;
    case 12: return SampleType::kFloat16;
    default: return std::nullopt;
  }
}

Vec3 Floats(const BinaryHeader& fields, int word) {
  return {fields.At<float>(Word(word)), fields.At<float>(Word(word + 1)), fields.At<float>(Word(word + 2))};
}
Index3 Integers(const BinaryHeader& fields, int word) {
  return {fields.At<std::int32_t>(Word(word)), fields.At<std::int32_t>(Word(word + 1)), fields.At<std::int32_t>(Word(word + 2))};
}

// The steps along the axes a, b and c of the cell, in Angstrom: a along x, b in the plane of x and y. Voxels of 1 where no cell is stated.
std::array<Vec3, 3> CellSteps(const BinaryHeader& fields) {
  const Vec3 cell = Floats(fields, 11), degrees = Floats(fields, 14);
  const Index3 samples = Integers(fields, 8);
  Vec3 length = {1, 1, 1};
  for (int i = 0; i < 3; ++i) {
    if (cell[i] != 0 && samples[i] != 0) length[i] = cell[i] / samples[i];
  }
  const auto cosine = [&](int i) { return degrees[i] == 0 || degrees[i] == 90 ? 0 : std::cos(degrees[i] * std::numbers::pi / 180); };
  const double alpha = cosine(0), beta = cosine(1), gamma = cosine(2), sine = std::sqrt(1 - gamma * gamma);
  const double y = (alpha - beta * gamma) / sine;
  return {Vec3{length.x, 0, 0}, length.y * Vec3{gamma, sine, 0}, length.z * Vec3{beta, y, std::sqrt(1 - beta * beta - y * y)}};
}

Result<RawHeader> HeaderOf(const BinaryHeader& fields, SampleType type, const std::string& path, const ReadOptions& options) {
  const auto wrong = [&](const std::string& why) { return Status::InvalidArgument(path + ": " + why); };
  const Index3 stored = Integers(fields, 1);
  // A stack of volumes says how many sections each has.
  constexpr std::int32_t kVolumeStack = 401;
  const std::int32_t sections = fields.At<std::int32_t>(Word(10)), space_group = fields.At<std::int32_t>(Word(23));
  const bool stack = space_group >= kVolumeStack && sections > 0;
  if (stack && stored.z % sections != 0)
    return wrong(fmt::format("has {} sections, which is no multiple of the {} of a volume", stored.z, sections));
  RawHeader header{.type = type};
  const std::vector<double> sizes = {double(stored.x), double(stored.y), double(stack ? sections : stored.z),
                                     double(stack ? stored.z / sections : 1)};
  if (Status status = SetSize(header, path, sizes, options); !status.ok()) return status;

  // Which axis of the cell columns, rows and sections run along; files that do not say have them along x, y and z.
  Index3 axes = Integers(fields, 17);
  if (axes == Index3{0, 0, 0}) axes = {1, 2, 3};
  Index3 seen;
  const std::array<Vec3, 3> steps = CellSteps(fields);
  header.world = World::kScene;
  header.matrix = "cell";
  if (Floats(fields, 11) != Vec3{}) header.unit = LengthUnit::kAngstrom;  // there is a cell
  const Index3 starts = Integers(fields, 5);
  for (int i = 0; i < 3; ++i) {
    if (axes[i] < 1 || axes[i] > 3 || seen[axes[i] - 1]++ != 0) {
      return wrong(fmt::format("MAPC, MAPR and MAPS are {}, {} and {}, must be 1, 2 and 3 in some order", axes.x, axes.y, axes.z));
    }
    header.steps[std::size_t(i)] = steps[std::size_t(axes[i] - 1)];
    header.origin = header.origin + double(starts[i]) * header.steps[std::size_t(i)];
  }
  // A file may say where its volume lies in a second way, which counts if it is there.
  if (const Vec3 origin = Floats(fields, 50); origin != Vec3{}) {
    if (starts != Index3{0, 0, 0}) header.notes.emplace_back("placed by ORIGIN, not by NXSTART, NYSTART and NZSTART");
    header.origin = origin;
  }
  return header;
}

Result<LocatedSamples> Locate(const std::string& path, const ReadOptions& options) {
  Payload payload{.file = path, .compression = CompressionOf(path)};
  std::array<std::byte, kHeaderBytes> bytes{};
  if (Status status = ReadPayload(payload, bytes, Extent::kStart); !status.ok()) return status;
  const bool big_endian = IsBigEndian(bytes);
  const BinaryHeader fields(bytes, big_endian);
  constexpr std::array<std::byte, 4> kMap = {std::byte{'M'}, std::byte{'A'}, std::byte{'P'}, std::byte{' '}};
  if (!std::ranges::equal(std::span(bytes).subspan(Word(53), 4), kMap)) {
    return Status::InvalidArgument(path + ": not an MRC volume: the letters 'MAP ' are missing in its header");
  }
  const std::optional<SampleType> type = TypeOf(fields);
  if (!type) {
    return Status::InvalidArgument(
        fmt::format("{}: MRC mode {} is not supported; supported: 0, 1, 2, 6 and 12 (integers of 8 and 16 bits, floats)", path,
                    ModeText(fields.At<std::int32_t>(Word(4)))));
  }
  Result<RawHeader> header = HeaderOf(fields, *type, path, options);
  if (!header.ok()) return header.status();
  const std::int32_t extension = fields.At<std::int32_t>(Word(24));
  if (extension < 0)
    return Status::InvalidArgument(fmt::format("{}: the extended header has {} bytes, must be at least 0", path, extension));
  payload.Skip(std::int64_t{kHeaderBytes} + extension);
  payload.big_endian = big_endian;
  return LocatedSamples{*std::move(header), std::move(payload)};
}

}  // namespace

VolumeFormat Mrc() {
  return {.name = "MRC",
          .endings = {".mrc", ".mrcs", ".map", ".ccp4", ".rec", ".st", ".ali", ".mrc.gz", ".map.gz", ".mrc.bz2", ".map.bz2"},
          .options = {"time"},
          .locate = Locate};
}

}  // namespace slabstream
