#include "common/volume_io/raw_volume.h"

#include <fmt/format.h>

#include <bit>
#include <cmath>

#include "common/volume/memory_budget.h"

namespace slabstream {

Result<Index3> ToSize(const std::string& path, std::vector<double> sizes) {
  while (sizes.size() > 3 && sizes.back() == 1) sizes.pop_back();
  if (sizes.size() != 3) return Status::InvalidArgument(fmt::format("{}: has {} dimensions, must have 3", path, sizes.size()));
  Index3 size;
  for (const Axis axis : kAxes) {
    const double side = sizes[std::size_t(Number(axis))];
    if (!(side >= 1 && side <= kMaxVolumeSide && side == std::floor(side))) {
      return Status::InvalidArgument(
          fmt::format("{}: the size along {} is {}, must be a whole number in [1, {}]", path, Letter(axis), side, kMaxVolumeSide));
    }
    size[axis] = std::int32_t(side);
  }
  return size;
}

Result<RawVolume> ReadSamples(const std::string& path, const RawHeader& header, const Payload& payload, const ReadOptions& options) {
  // Samples in a file of their own: the volume's name first.
  const auto failed = [&](const Status& status) {
    return payload.file == path ? status : Status(status.code(), path + ": samples in " + status.message());
  };
  if (Status status = CheckHolds(payload, header.sample_bytes()); !status.ok()) return failed(status);
  if (Status status = CheckFitsMemory(header.sample_bytes(), path); !status.ok()) return status;
  RawVolume raw{header, {}};
  if (payload.file != path) raw.samples_file = payload.file;
  if (options.headers_only) return raw;
  raw.bytes.resize(std::size_t(header.sample_bytes()));
  if (Status status = ReadPayload(payload, raw.bytes); !status.ok()) return failed(status);
  static_assert(std::endian::native == std::endian::little, "this machine's samples are little endian");
  if (payload.big_endian) SwapByteOrder(header.type, raw.bytes);
  return raw;
}

}  // namespace slabstream
