#include "data/positional/located_volume.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "data/sources/copy_samples.h"
#include "data/volume_io/formats.h"
#include "data/volume_io/volume_reader.h"

namespace slabstream {
namespace {

// A row: its samples lie together.
Index3 BlockOf(const RawHeader& header, const AxisTurn& turn) {
  const Index3 stored = {header.size.x, 1, 1};
  return {stored[turn.from[0]], stored[turn.from[1]], stored[turn.from[2]]};
}

Status NotInParts(const std::string& path, const std::string& why) {
  return Status::InvalidArgument(fmt::format("{}: cannot be read in parts: {}", path, why));
}

Result<LocatedSamples> Locate(const VolumeFormat& format, const std::string& path, const ReadOptions& options, Packing packing) {
  if (format.locate == nullptr) return NotInParts(path, fmt::format("it is {}", format.name));
  Result<LocatedSamples> located = format.locate(path, options);
  if (!located.ok()) return located;
  const bool compressed = located->payload.compressed();
  if (compressed != (packing == Packing::kCompressed))
    return NotInParts(path, compressed ? "its samples are compressed" : "its samples are not compressed");
  if (packing == Packing::kNone && !located->payload.more.empty()) return NotInParts(path, "its samples are in several files");
  return located;
}

// InvalidArgument: the voxels would have to be straightened; or errors of PlaceInWorld.
Result<WorldPlacement> PlaceUpright(const RawHeader& header, const std::string& path) {
  Result<WorldPlacement> placed = PlaceInWorld(header, path);
  if (placed.ok() && placed->slant) return NotInParts(path, "its axes are not at right angles, so that its voxels are straightened");
  return placed;
}

}  // namespace

Result<LocatedVolume> LocateVolume(const std::string& path, const ReadOptions& options, Packing packing) {
  if (Status status = CheckVolume(path, options); !status.ok()) return status;
  const VolumeFormat& format = *FindFormat(path, options);
  const Result<LocatedSamples> located = Locate(format, path, options, packing);
  if (!located.ok()) return located.status();
  const RawHeader& header = located->header;
  if (Status status = CheckChannel(path, header, options); !status.ok()) return status;
  if (options.channel == kLuminance) return NotInParts(path, "luminance needs several components of a voxel");
  const Result<WorldPlacement> placed = PlaceUpright(header, path);
  if (!placed.ok()) return placed.status();
  Result<Payload> payload = PayloadOfVolume(path, *located);
  if (!payload.ok()) return payload.status();

  const auto [type, shift] = KeptTypeOf(header.type);
  // value = scale * (stored + shift) + offset
  const auto [scale, offset] = header.rescale;
  const VolumeDescription description = {placed->geometry, type, {scale, scale * shift + offset}};
  SourceInfo info = {.levels = {{description, BlockOf(header, placed->turn)}},
                     .format = std::string(format.name),
                     .file_type = std::string(ToString(header.type)),
                     .exact = {header.type, header.rescale},
                     .labels = header.labels,
                     .channels = header.channels,
                     .channel = header.channel,
                     .times = int(header.volumes),
                     .time = int(header.number),
                     .notes = header.notes,
                     .files = {path}};
  if (MayBeRounded(header.type)) info.notes.push_back(RoundingText(header.type));
  const int component = header.components > 1 ? options.channel.value_or(0) : 0;
  if (header.components > 1) info.channels.resize(std::size_t(header.components));
  for (const std::filesystem::path& other : payload->FilesBeside(path)) info.files.push_back(other.string());
  return LocatedVolume{header, *std::move(payload), placed->turn, component, std::move(info)};
}

bool HasLocatedSamples(const std::string& path, const ReadOptions& options, Packing packing) {
  if (!CheckVolume(path, options).ok()) {
    // Options that a format requires are not known yet.
    const VolumeFormat* const format = FindFormat(path, options);
    return format != nullptr && format->locate != nullptr && !format->required.empty() && packing == Packing::kNone;
  }
  if (options.channel == kLuminance) return false;
  ReadOptions any_time = options;
  if (!any_time.time) any_time.time = TimeRange{};
  const Result<LocatedSamples> located = Locate(*FindFormat(path, options), path, any_time, packing);
  if (!located.ok()) return false;
  // Axes that a file does not state are at right angles.
  return located->header.world == World::kVoxels || PlaceUpright(located->header, path).ok();
}

}  // namespace slabstream
