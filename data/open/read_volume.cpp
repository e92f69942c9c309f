#include "data/open/read_volume.h"

#include <fmt/format.h>

#include <new>
#include <utility>

#include "common/base/log.h"
#include "common/volume/memory_budget.h"
#include "data/open/open_source.h"
#include "data/volume_io/chosen_channel.h"

namespace slabstream {

Result<LoadedVolume> ReadVolume(const std::string& path, const ReadOptions& options, bool all_exact) {
  const Result<std::shared_ptr<VolumeSource>> source = OpenSource(path, options, ProcessReadContext());
  if (!source.ok()) return source.status();
  Result<LoadedVolume> loaded = ReadVolume(**source, path, options, {.all_exact = all_exact});
  if (loaded.ok()) WarnOfPart(path, options, loaded->info);
  return loaded;
}

Result<LoadedVolume> ReadVolume(VolumeSource& source, const std::string& path, const ReadOptions& options, LevelWanted wanted) try {
  // What is decoded as a whole checks for itself what it takes.
  if (Status fits = source.info().whole ? Status::Ok() : CheckFitsMemory(source.info().finest().voxel_bytes(), path); !fits.ok())
    return fits;
  wanted.narrow = true;
  Result<LevelInMemory> level = source.ReadLevel(0, options.progress, wanted);
  if (!level.ok()) return level.status();
  LoadedVolume loaded{*std::move(level), source.info()};
  loaded.info.levels.front().description = loaded.volume->description;
  return loaded;
} catch (const std::bad_alloc&) {
  return Status::ResourceExhausted(path + ": does not fit the memory");
}

Result<std::vector<std::string>> CheckVolumeHeaders(const std::string& path, const ReadOptions& options) {
  ReadOptions of_headers = options;
  of_headers.headers_only = true;
  const Result<std::shared_ptr<VolumeSource>> source = OpenSource(path, of_headers, ProcessReadContext());
  return source.ok() ? Result((*source)->info().files) : source.status();
}

std::vector<std::string> PartTexts(const std::string& path, const ReadOptions& options, const SourceInfo& info) {
  std::vector<std::string> texts;
  if (!options.time && info.times.count > 1) {
    texts.push_back(
        fmt::format("{}: shows time {} of {}; --time takes another one: 0 to {}", path, info.time, info.times.count, info.times.count - 1));
  }
  if (info.components == 1) {
    if (auto channel = ShownChannelText(path, info.channels, info.channel, options)) texts.push_back(*std::move(channel));
  } else if (!options.channel) {
    const int count = info.components;
    const std::string_view colour = count == 3 || count == 4 ? ", or luminance, of red, green and blue" : "";
    const std::string_view vector = count <= kMostVectorComponents ? ", or magnitude, of a vector" : "";
    texts.push_back(
        fmt::format("{}: shows component 0 of {}; --channel takes another one: 0 to {}{}{}", path, count, count - 1, colour, vector));
  }
  return texts;
}

void WarnOfPart(const std::string& path, const ReadOptions& options, const SourceInfo& info) {
  for (const std::string& text : PartTexts(path, options, info)) LogWarning(text);
}

}  // namespace slabstream
