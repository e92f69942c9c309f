// Files as times: "run/cell_*.tif" is one source with a time for each file, in natural order of their names ("cell_2" before "cell_10"),
// and so is a file that names them (series_file.h). Microscopes and simulations write a file for each time, while somebody looks.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "common/base/status.h"
#include "data/sources/volume_source.h"
#include "data/volume_io/read_options.h"

namespace slabstream {

inline constexpr std::size_t kMaxFileTimes = 100'000;

// Whether the path names a series, or is a pattern: its last part has a '*', which stands for any characters, and there is no file of that
// name.
bool NamesFileTimes(const std::string& path);

// The file of the first time. NotFound: there is none. ResourceExhausted: more than kMaxFileTimes. Errors of ReadSeriesFile.
Result<std::string> FirstFileOf(const std::string& path);

using OpenFileFunction = std::function<Result<std::shared_ptr<VolumeSource>>(const std::string& file, const ReadOptions& options)>;

// The time that `options` name, or the first one; opened by `open`. Without a time, the newest file counts only if it can be opened: it may
// still be written. Errors of FirstFileOf and `open`; InvalidArgument: there is no such time, none is named and options.describe is false
// though there are several, or a file holds several times itself.
Result<std::shared_ptr<VolumeSource>> OpenFileTimes(const std::string& path, const ReadOptions& options, const OpenFileFunction& open);

}  // namespace slabstream
