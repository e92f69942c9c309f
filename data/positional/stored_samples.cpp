#include "data/positional/stored_samples.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/uio.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <system_error>
#include <utility>

#include "common/memory/pooled_vector.h"

namespace slabstream {
namespace {

// What lies between two rows is read, too, if it is less than a page, since the disk then gives all pages of it anyway.
constexpr std::int64_t kGap = 4096;

}  // namespace

Result<std::shared_ptr<StoredSamples>> StoredSamples::Open(const RawHeader& header, const Payload& payload, int component) {
  const auto file = std::make_shared<const FileDescriptor>(::open(payload.file.c_str(), O_RDONLY | O_CLOEXEC));
  if (file->number() < 0) {
    return Status::Unavailable(
        fmt::format("{}: cannot be opened for reading: {}", payload.file.string(), std::generic_category().message(errno)));
  }
  return std::make_shared<StoredSamples>(header, payload, component, file);
}

StoredSamples::StoredSamples(const RawHeader& header, const Payload& payload, int component, std::shared_ptr<const FileDescriptor> file)
    : name_(payload.file.string()),
      file_(std::move(file)),
      type_(header.type),
      big_endian_(payload.big_endian),
      first_(payload.offset + component * std::int64_t(BytesPerSample(header.type))),
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

// Samples that are wanted as they are in the file, in its order: rows of them need no memory on the way.
bool StoredSamples::CanReadInto(const Box& part, const TurnedBox& to) const {
  const bool kept_as_stored = to.out.exact || type_ == SampleType::kUint8 || type_ == SampleType::kUint16 || type_ == SampleType::kFloat32;
  if (!kept_as_stored || (big_endian_ && sample_ > 1) || voxel_ != sample_ || to.turn != AxisTurn{}) return false;
  const Index3 size = part.size();
  // What ReadRows reads together must not hold what belongs to nobody here.
  const bool rows_as_in_file = to.out.row * sample_ == row_, slices_as_in_file = to.out.slice * sample_ == slice_;
  if (RowBytes(size) != row_) return !rows_as_in_file && PitchFor(size).row != row_;
  return !rows_as_in_file || !slices_as_in_file || size.z == 1 || size.y * row_ == slice_;
}

std::int64_t StoredSamples::MemoryFor(const Box& part, const TurnedBox& to) const {
  if (CanReadInto(part, to)) return 0;
  const Index3 size = part.size();
  const Pitch pitch = PitchFor(size);
  return (size.z - 1) * pitch.slice + (size.y - 1) * pitch.row + RowBytes(size);
}

Status StoredSamples::Read(const Box& part, const TurnedBox& to) {
  if (CanReadInto(part, to)) {
    return ReadRows(part, to.Place(part, type_).first, {to.out.row * sample_, to.out.slice * sample_});
  }

  UnwrittenVector<std::byte> stored(std::size_t(MemoryFor(part, to)));
  const Pitch pitch = PitchFor(part.size());
  if (Status status = ReadRows(part, stored.data(), pitch); !status.ok()) return status;
  if (big_endian_) SwapByteOrder(type_, stored);
  to.Fill(part, type_, stored.data(), {voxel_ / sample_, pitch.row / sample_, pitch.slice / sample_});
  return Status::Ok();
}

// Where rows or slices lie in memory as far apart as in the file, one read brings all of them. One read brings whole rows to any place.
Status StoredSamples::ReadRows(const Box& part, std::byte* to, const Pitch& pitch) {
  const Index3 size = part.size();
  if (RowBytes(size) == row_ && pitch.row != row_) {
    for (std::int32_t z = 0; z < size.z; ++z) {
      const std::int64_t offset = first_ + (part.begin.z + z) * slice_ + part.begin.y * row_;
      if (Status status = ReadApart(offset, to + z * pitch.slice, size.y, pitch.row); !status.ok()) return status;
    }
    return Status::Ok();
  }
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

// Rows that follow each other in the file.
Status StoredSamples::ReadApart(std::int64_t offset, std::byte* to, std::int64_t rows, std::int64_t pitch) {
  constexpr std::int64_t kMostRows = 256;  // of a call; systems take at least 1024 (IOV_MAX)
  for (std::int64_t done = 0; done < rows * row_;) {
    // A read may end within a row.
    const std::int64_t row = done / row_, within = done % row_;
    std::array<iovec, kMostRows> places;
    const auto count = std::size_t(std::min(kMostRows, rows - row));
    for (std::size_t i = 0; i < count; ++i) places.at(i) = {to + (row + std::int64_t(i)) * pitch, std::size_t(row_)};
    places[0] = {to + row * pitch + within, std::size_t(row_ - within)};
    const Result<std::int64_t> got = Got(::preadv(file_->number(), places.data(), int(count), off_t(offset + done)), offset + done);
    if (!got.ok()) return got.status();
    done += *got;
  }
  return Status::Ok();
}

Status StoredSamples::ReadAt(std::int64_t offset, std::byte* to, std::int64_t bytes) {
  for (std::int64_t done = 0; done < bytes;) {
    const Result<std::int64_t> got =
        Got(::pread(file_->number(), to + done, std::size_t(bytes - done), off_t(offset + done)), offset + done);
    if (!got.ok()) return got.status();
    done += *got;
  }
  return Status::Ok();
}

// What the system says of a read at `offset`; 0: it was interrupted.
Result<std::int64_t> StoredSamples::Got(std::int64_t bytes, std::int64_t offset) {
  if (bytes < 0 && errno == EINTR) return std::int64_t{0};
  if (bytes < 0) return Status::Unavailable(fmt::format("{}: cannot be read: {}", name_, std::generic_category().message(errno)));
  if (bytes == 0) return Status::DataLoss(fmt::format("{}: truncated: it has become shorter, and ends before byte {}", name_, offset + 1));
  read_bytes_ += std::uint64_t(bytes);
  return bytes;
}

}  // namespace slabstream
