// Parts of writers: a header and samples go into a file that is written whole or not at all (common/files/files.h).
#pragma once

#include <string>

#include "common/base/status.h"
#include "common/files/files.h"
#include "common/math/vec.h"
#include "data/volume_io/file_samples.h"

namespace slabstream {

enum class Gzipped { kNothing, kSamples, kAll };

// A file of a header and the samples behind it. Unavailable: it cannot be written.
Status WriteHeaderAndSamples(const std::string& path, const std::string& header, const FileSamples& samples,
                             Gzipped gzipped = Gzipped::kNothing);

void AppendSamples(OutputFile& file, const FileSamples& samples);

// Three of the shortest numbers that are read back as the same.
std::string Numbers(const Vec3& v, const char* separator = " ");

}  // namespace slabstream
