// Volume files that the user names on the command line: every error in them is bad input.
#pragma once

#include <string>

#include "common/base/status.h"
#include "data/open/read_volume.h"
#include "data/sources/volume_source.h"

namespace slabstream {

// `source`: a path, with options for reading it or without (read_options.h).

// NotFound: no such file. InvalidArgument: not a volume by its name (names the known endings), or an option that it does not take. Reads no
// samples.
Status CheckInputVolume(const std::string& source);
Status CheckInputVolume(const SourceText& source);

// InvalidArgument: the source lacks the level of --level; the message lists the levels that it has.
Status CheckLevel(int level, const SourceInfo& info, const std::string& path);

// Reads the headers as well, and checks all that can be checked without the samples: whether there is such a time, for example.
Status CheckInputHeaders(const std::string& source);

// ReadVolume. If there are several times or components, the first one is read, unless the source
// says which, and a line is logged. A parsed source must say which.
Result<LoadedVolume> ReadInputVolume(const std::string& source);
Result<LoadedVolume> ReadInputVolume(const SourceText& source, bool all_exact = false);

}  // namespace slabstream
