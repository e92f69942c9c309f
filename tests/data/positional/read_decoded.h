// Volumes as they are decoded as a whole, whatever else their formats allow: other code than what reads boxes.
#pragma once

#include <string>
#include <utility>

#include "common/base/check.h"
#include "data/open/open_source.h"
#include "data/open/read_volume.h"
#include "data/positional/decoded_source.h"

namespace slabstream {

inline Result<LoadedVolume> ReadDecoded(const std::string& path, const ReadOptions& options = {}) {
  const VolumeFormat* const format = FindFormat(path, options);
  CHECK(format != nullptr) << path;
  const Result<std::shared_ptr<VolumeSource>> source = OpenDecoded(*format, path, options);
  if (!source.ok()) return source.status();
  Result<LevelInMemory> level = (*source)->ReadLevel(0, nullptr, {.all_exact = true});
  if (!level.ok()) return level.status();
  LoadedVolume loaded{*std::move(level), (*source)->info()};
  loaded.info.levels.front().description = loaded.volume->description;
  return loaded;
}

}  // namespace slabstream
