#include "data/positional/slice_stream.h"

#include <algorithm>
#include <new>
#include <utility>

#include "common/base/printable.h"
#include "common/volume/memory_budget.h"
#include "data/positional/turned_box.h"

namespace slabstream {

bool SliceStream::Recognises(const std::string& path) { return HasLocatedSamples(path, {}, Packing::kCompressed); }

Result<SliceStream> SliceStream::Open(const std::string& path, const ReadOptions& options) {
  Result<LocatedVolume> volume = LocateVolume(path, options, Packing::kCompressed);
  if (!volume.ok()) return Printable(volume.status());
  return SliceStream(path, *std::move(volume));
}

Axis SliceStream::along() const { return kAxes[std::size_t(std::ranges::find(volume_.turn.from, 2) - volume_.turn.from.begin())]; }

Status SliceStream::Read(std::int32_t slices, const Take& take, std::stop_token stop) const {
  try {
    return Printable(ReadAll(slices, take, stop));
  } catch (const std::bad_alloc&) {
    return Status::ResourceExhausted(path_ + ": its slices do not fit the memory");
  }
}

Status SliceStream::ReadAll(std::int32_t slices, const Take& take, const std::stop_token& stop) const {
  const RawHeader& header = volume_.header;
  const VolumeDescription& description = volume_.info.levels.front().description;
  slices = std::clamp(slices, 1, header.size.z);
  const auto slice_bytes = std::size_t(header.sample_bytes() / header.size.z),
             kept_slice_bytes = std::size_t(description.voxel_bytes() / header.size.z);
  if (Status status = CheckFitsMemory(slices * std::int64_t(slice_bytes + kept_slice_bytes), path_); !status.ok()) return status;
  AlignedVector<std::byte> stored(std::size_t(slices) * slice_bytes), kept(std::size_t(slices) * kept_slice_bytes);

  PayloadStream stream(volume_.payload, header.sample_bytes());
  if (Status status = stream.Open(); !status.ok()) return status;
  TurnedBox to{.turn = volume_.turn, .size = description.geometry.size, .box = {}, .out = {}};
  const std::array<std::int64_t, 3> steps = {header.components, std::int64_t{header.components} * header.size.x,
                                             std::int64_t{header.components} * header.size.x * header.size.y};
  // From the volume's end on, what is left beyond the last multiple comes first.
  const bool from_end = volume_.turn.flipped[std::size_t(Number(along()))];
  std::int32_t count = from_end && header.size.z % slices != 0 ? header.size.z % slices : slices;
  for (std::int32_t z = 0; z < header.size.z; z += count, count = std::min(slices, header.size.z - z)) {
    if (stop.stop_requested()) return Status::Cancelled(path_ + ": reading was cancelled");
    const std::span bytes = std::span(stored).first(std::size_t(count) * slice_bytes);
    if (Status status = stream.Read(bytes); !status.ok()) return status;
    if (volume_.payload.big_endian) SwapByteOrder(header.type, bytes);
    const Box part = {{0, 0, z}, {header.size.x, header.size.y, z + count}};
    to.box = to.Turned(part);
    to.out = BoxRoom::Dense(to.box, kept.data());
    to.Fill(part, header.type, stored.data() + std::size_t(volume_.channel) * BytesPerSample(header.type), steps);
    if (Status status = take(to.box, std::span(kept).first(std::size_t(count) * kept_slice_bytes)); !status.ok()) return status;
  }
  return stream.Finish();
}

}  // namespace slabstream
