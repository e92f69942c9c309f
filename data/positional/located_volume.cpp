#include "data/positional/located_volume.h"

#include "data/sources/copy_samples.h"

namespace slabstream {

SourceInfo InfoOfFile(const std::string& format, const std::string& path, const RawHeader& header, const WorldPlacement& placed,
                      const std::vector<std::filesystem::path>& beside, const Index3& block, const ReadOptions& options) {
  const auto [type, shift] = KeptTypeOf(header.type);
  // value = scale * (stored + shift) + offset
  const VolumeDescription description = {placed.geometry, type, {header.rescale.scale, header.rescale.FromStored(shift)}};
  const std::array<int, 3>& from = placed.turn.from;
  SourceInfo info = {.levels = {{description, {block[from[0]], block[from[1]], block[from[2]]}}},
                     .format = format,
                     .file_type = std::string(ToString(header.type)),
                     .exact = {header.type, header.rescale},
                     .labels = header.labels || options.labels,
                     .channels = header.channels,
                     .channel = header.channel,
                     .times = header.times,
                     .time = int(header.number),
                     .notes = header.notes,
                     .files = {path},
                     .stored = StoredAxes{header.size, header.steps, placed.slant.has_value()},
                     .uneven = placed.uneven};
  if (header.channels.empty() && header.components > 1) {
    info.components = header.components;
    info.channels.resize(std::size_t(header.components));
    info.channel = std::max(options.channel.value_or(0), 0);
  }
  for (const std::filesystem::path& other : beside) info.files.push_back(other.string());
  return info;
}

}  // namespace slabstream
