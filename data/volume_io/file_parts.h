// Which part of a file is shown: of several times, channels or components of a voxel one. Who does not say which sees the first one, and a
// line that says so and how to choose.
#pragma once

#include <string>
#include <vector>

#include "common/base/status.h"
#include "data/volume_io/read_options.h"

namespace slabstream {

struct FileParts {
  int times = 1, time = 0;            // how many, and the one that is read
  std::vector<std::string> channels;  // of an image: their names, some of which may be empty
  int channel = 0;
  int components = 1;  // of a voxel
};

// By the headers. Errors of CheckVolumeHeaders (volume_reader.h).
Result<FileParts> PartsOf(const std::string& path, const ReadOptions& options);

// A line, which begins with `path`, for each choice that `options` leave open.
std::vector<std::string> ShownTexts(const std::string& path, const FileParts& parts, const ReadOptions& options);

}  // namespace slabstream
