#include "common/volume_io/raw_volume.h"

#include <algorithm>
#include <bit>

#include "common/volume/memory_budget.h"

namespace slabstream {

Status CheckSize(const std::string& path, const std::array<std::int64_t, 3>& size) {
  for (const Axis axis : kAxes) {
    const std::int64_t side = size[std::size_t(Number(axis))];
    if (side < 1 || side > kMaxVolumeSide) {
      return Status::InvalidArgument(path + ": the size along " + Letter(axis) + " is " + std::to_string(side) + ", must be in [1, " +
                                     std::to_string(kMaxVolumeSide) + "]");
    }
  }
  return Status::Ok();
}

Result<Payload> FromTheEnd(Payload payload, const std::string& path, std::int64_t sample_bytes) {
  std::error_code error;
  const auto file_bytes = std::filesystem::file_size(payload.file, error);
  if (error) return Status::NotFound(path + ": samples in " + payload.file.string() + ": " + error.message());
  payload.offset = std::max(payload.offset, std::int64_t(file_bytes) - sample_bytes);
  return payload;
}

Result<RawVolume> ReadSamples(const std::string& path, const RawHeader& header, const Payload& payload) {
  // Samples in a file of their own: the volume's name first.
  const auto failed = [&](const Status& status) {
    return payload.file == path ? status : Status(status.code(), path + ": samples in " + status.message());
  };
  if (Status status = CheckHolds(payload, header.sample_bytes()); !status.ok()) return failed(status);
  if (Status status = CheckFitsMemory(header.sample_bytes(), path); !status.ok()) return status;
  RawVolume raw{header, AlignedVector<std::byte>(std::size_t(header.sample_bytes()))};
  if (Status status = ReadPayload(payload, raw.bytes); !status.ok()) return failed(status);
  if (payload.big_endian != (std::endian::native == std::endian::big)) SwapByteOrder(header.type, raw.bytes);
  return raw;
}

}  // namespace slabstream
