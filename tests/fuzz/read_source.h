// What must hold of every source that opens, and of every refusal.
#pragma once

#include <string>

#include "common/volume/volume.h"
#include "data/open/open_source.h"
#include "tests/fuzz/fuzz_target.h"
#include "tests/support/temporary_directory.h"

namespace slabstream {

// The path of a file or folder that a target writes for each input.
inline std::string PathOfSource(const std::string& name) {
  static const TemporaryDirectory directory{PlaceOfFuzzFiles()};
  return directory / name;
}

// Opens the source and reads a small box of each level. Whether all of that went well.
inline bool ReadSource(const std::string& path, const ReadOptions& options) {
  static const auto context = std::make_shared<ReadContext>(ReadContext::Limits{.decode_threads = 1});
  const Result<std::shared_ptr<VolumeSource>> source = OpenSource(path, options, context);
  if (!source.ok()) {
    CheckRefusal(source.status());
    return false;
  }
  bool all = true;
  const SourceInfo& info = (*source)->info();
  CHECK(!info.levels.empty());
  for (std::size_t level = 0; level < info.levels.size(); ++level) {
    const VolumeDescription& description = info.levels[level].description;
    for (const Axis axis : kAxes) {
      CHECK(description.geometry.size[axis] >= 1 && description.geometry.size[axis] <= kMaxVolumeSide);
      CHECK(description.geometry.spacing[axis] > 0);
    }
    const Box box = {{0, 0, 0}, Min(description.geometry.size, Uniform(24))};
    std::vector<std::byte> samples(std::size_t(box.voxel_count()) * BytesPerSample(description.type));
    const Status status = (*source)->ReadNow(int(level), box, samples);
    if (status.ok()) continue;
    CheckRefusal(status);
    all = false;
  }
  return all;
}

}  // namespace slabstream
