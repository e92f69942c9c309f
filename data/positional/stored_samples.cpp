#include "data/positional/stored_samples.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <system_error>
#include <utility>

#include "common/base/unwritten_vector.h"

namespace slabstream {
namespace {

// What lies between two rows is read, too, if it is less than a page, since the disk then gives all pages of it anyway.
constexpr std::int64_t kGap = 4096;

}  // namespace

Result<std::shared_ptr<StoredSamples>> StoredSamples::Open(const RawHeader& header, const Payload& payload, int channel) {
  FileDescriptor file(::open(payload.file.c_str(), O_RDONLY | O_CLOEXEC));
  if (file.number() < 0) {
    return Status::Unavailable(
        fmt::format("{}: cannot be opened for reading: {}", payload.file.string(), std::generic_category().message(errno)));
  }
  return std::shared_ptr<StoredSamples>(new StoredSamples(header, payload, channel, std::move(file)));
}

StoredSamples::StoredSamples(const RawHeader& header, const Payload& payload, int channel, FileDescriptor file)
    : name_(payload.file.string()),
      file_(std::move(file)),
      type_(header.type),
      big_endian_(payload.big_endian),
      first_(payload.offset + channel * std::int64_t(BytesPerSample(header.type))),
      sample_(std::int64_t(BytesPerSample(header.type))),
      voxel_(sample_ * header.components),
      row_(voxel_ * header.size.x),
      slice_(row_ * header.size.y) {}

StoredSamples::Pitch StoredSamples::PitchFor(const Index3& size) const {
  const std::int64_t row_bytes = RowBytes(size);
  const bool joined = row_ - row_bytes < kGap;
  const std::int64_t row = joined ? row_ : row_bytes, slice = row * size.y;
  return {row, joined && slice_ - slice + row_ - row_bytes < kGap ? slice_ : slice};
}

std::vector<Box> StoredSamples::Parts(const Box& box) const {
  const Index3 size = box.size();
  const Pitch pitch = PitchFor(size);
  const auto most = [](std::int64_t bytes) { return std::int32_t(std::clamp<std::int64_t>(kPartBytes / bytes, 1, kMaxVolumeSide)); };
  // A short row on its own costs as much as a page, so many of them are read by several threads.
  const bool joined = pitch.row == row_;
  const std::int64_t row = joined ? pitch.row : std::max(pitch.row, kGap), slice = joined ? pitch.slice : row * size.y;
  Index3 step = {size.x, size.y, most(slice)};
  if (slice > kPartBytes) step.y = most(row);
  if (row > kPartBytes) step.x = most(voxel_);
  std::vector<Box> parts;
  for (std::int32_t z = box.begin.z; z < box.end.z; z += step.z) {
    for (std::int32_t y = box.begin.y; y < box.end.y; y += step.y) {
      for (std::int32_t x = box.begin.x; x < box.end.x; x += step.x) parts.push_back({{x, y, z}, Min(Index3{x, y, z} + step, box.end)});
    }
  }
  return parts;
}

// Samples that are kept as they are in the file, in its order: rows of them need no memory on the way.
bool StoredSamples::CanReadInto(const Box& part, const TurnedBox& to) const {
  const bool kept_as_stored =
      type_ == SampleType::kUint8 || ((type_ == SampleType::kUint16 || type_ == SampleType::kFloat32) && !big_endian_);
  if (!kept_as_stored || voxel_ != sample_ || to.turn != AxisTurn{}) return false;
  // Whole rows lie in memory as in the file.
  return RowBytes(part.size()) == row_ || PitchFor(part.size()).row != row_;
}

std::int64_t StoredSamples::MemoryFor(const Box& part, const TurnedBox& to) const {
  if (CanReadInto(part, to)) return 0;
  const Index3 size = part.size();
  const Pitch pitch = PitchFor(size);
  return (size.z - 1) * pitch.slice + (size.y - 1) * pitch.row + RowBytes(size);
}

Status StoredSamples::Read(const Box& part, const TurnedBox& to) {
  if (CanReadInto(part, to)) {
    const Index3 size = to.box.size();
    return ReadRows(part, to.Place(part, type_), {size.x * sample_, size.x * sample_ * size.y});
  }

  UnwrittenVector<std::byte> stored(std::size_t(MemoryFor(part, to)));
  const Pitch pitch = PitchFor(part.size());
  if (Status status = ReadRows(part, stored.data(), pitch); !status.ok()) return status;
  if (big_endian_) SwapByteOrder(type_, stored);
  to.Fill(part, type_, stored.data(), {voxel_ / sample_, pitch.row / sample_, pitch.slice / sample_});
  return Status::Ok();
}

// Where rows or slices lie in memory as far apart as in the file, one read brings all of them.
Status StoredSamples::ReadRows(const Box& part, std::byte* to, const Pitch& pitch) {
  const Index3 size = part.size();
  const bool rows_joined = pitch.row == row_, slices_joined = rows_joined && pitch.slice == slice_;
  const std::int32_t rows = rows_joined ? size.y : 1, slices = slices_joined ? size.z : 1;
  const std::int64_t bytes = (slices - 1) * slice_ + (rows - 1) * row_ + RowBytes(size);
  for (std::int32_t z = 0; z < size.z; z += slices) {
    for (std::int32_t y = 0; y < size.y; y += rows) {
      const std::int64_t offset = first_ + (part.begin.z + z) * slice_ + (part.begin.y + y) * row_ + part.begin.x * voxel_;
      if (Status status = ReadAt(offset, to + z * pitch.slice + y * pitch.row, bytes); !status.ok()) return status;
    }
  }
  return Status::Ok();
}

Status StoredSamples::ReadAt(std::int64_t offset, std::byte* to, std::int64_t bytes) {
  while (bytes > 0) {
    const ssize_t got = ::pread(file_.number(), to, std::size_t(bytes), off_t(offset));
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) return Status::Unavailable(fmt::format("{}: cannot be read: {}", name_, std::generic_category().message(errno)));
    if (got == 0) return Status::DataLoss(fmt::format("{}: truncated: it has become shorter, and ends before byte {}", name_, offset + 1));
    read_bytes_ += std::uint64_t(got);
    to += got;
    offset += got;
    bytes -= got;
  }
  return Status::Ok();
}

}  // namespace slabstream
