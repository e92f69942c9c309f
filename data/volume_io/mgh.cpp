// Volumes of FreeSurfer (.mgh, .mgz), by the fields of its MGH format: big endian, placed by the centre of the volume in the scanner's
// space.
#include <fmt/format.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "common/base/second_of.h"
#include "data/volume_io/binary_header.h"
#include "data/volume_io/formats.h"

namespace slabstream {
namespace {

constexpr std::size_t kHeaderBytes = 90;  // of fields
constexpr std::int64_t kSamplesOffset = 284;

constexpr std::array<std::pair<std::int32_t, SampleType>, 5> kTypes = {
    {{0, SampleType::kUint8}, {1, SampleType::kInt32}, {3, SampleType::kFloat32}, {4, SampleType::kInt16}, {10, SampleType::kUint16}}};

void Place(const BinaryHeader& fields, RawHeader& header) {
  header.world = World::kPatient;
  header.matrix = "x_ras, y_ras, z_ras";
  const auto triple = [&](std::size_t offset) {
    return Vec3{fields.At<float>(offset), fields.At<float>(offset + 4), fields.At<float>(offset + 8)};
  };
  Vec3 centre;
  if (fields.At<std::int16_t>(28) > 0) {
    const Vec3 spacing = triple(30);
    for (int i = 0; i < 3; ++i) header.steps[std::size_t(i)] = spacing[i] * triple(42 + 12 * std::size_t(i));
    centre = triple(78);
    header.notes.emplace_back("placed in the scanner's space (c_ras), not in that of FreeSurfer's surfaces (tkr)");
  } else {
    header.steps = {Vec3{-1, 0, 0}, Vec3{0, 0, -1}, Vec3{0, 1, 0}};
    header.notes.emplace_back("states no axes (ras_good_flag is 0): taken for FreeSurfer's usual coronal slices, with voxels of 1 mm");
  }
  header.origin = centre;
  for (int i = 0; i < 3; ++i) header.origin = header.origin - 0.5 * header.size[i] * header.steps[std::size_t(i)];
}

Result<LocatedSamples> Locate(const std::string& path, const ReadOptions& options) {
  const auto wrong = [&](const std::string& why) { return Status::InvalidArgument(path + ": " + why); };
  Payload payload{.file = path, .compression = CompressionOf(path), .big_endian = true};
  std::array<std::byte, kHeaderBytes> bytes{};
  if (Status status = ReadPayload(payload, bytes, Extent::kStart); !status.ok()) return status;
  const BinaryHeader fields(bytes, true);
  const auto integer = [&](std::size_t offset) { return fields.At<std::int32_t>(offset); };
  if (integer(0) != 1) return wrong(fmt::format("not an MGH volume: the version is {}, must be 1", integer(0)));
  const std::optional<SampleType> type = SecondOf(kTypes, integer(20));
  if (!type) {
    return wrong(
        fmt::format("MGH type {} is not supported; supported: 0, 1, 3, 4 and 10 (uint8, int32, float32, int16, uint16)", integer(20)));
  }
  RawHeader header{.type = *type};
  const std::vector<double> sizes = {double(integer(4)), double(integer(8)), double(integer(12)), double(integer(16))};
  if (Status status = SetSize(header, path, sizes, options); !status.ok()) return status;
  Place(fields, header);
  payload.Skip(kSamplesOffset);
  return LocatedSamples{std::move(header), std::move(payload)};
}

}  // namespace

VolumeFormat Mgh() { return {.name = "MGH", .endings = {".mgh", ".mgz", ".mgh.gz"}, .options = {"time"}, .locate = Locate}; }

}  // namespace slabstream
