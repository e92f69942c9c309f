// Files as times: "run/cell_*.tif" is one source with a time for each file, in natural order of their names ("cell_2" before "cell_10"),
// and so is a file that names them (series_file.h). Microscopes and simulations write a file for each time, while somebody looks.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "common/base/status.h"
#include "common/volume/field_info.h"
#include "data/open/series_file.h"
#include "data/sources/volume_source.h"
#include "data/volume_io/read_options.h"

namespace slabstream {

inline constexpr std::size_t kMaxFileTimes = 100'000;

// Whether the path names a series, or is a pattern: its last part has a '*', which stands for any characters, and there is no file of that
// name.
bool NamesFileTimes(const std::string& path);

// The files of such a path, in order of their times, which are the numbers of the files if the path is a pattern; never none. NotFound:
// there is none. ResourceExhausted: more than kMaxFileTimes. InvalidArgument: a series names another one. Errors of ReadSeriesFile.
Result<std::vector<TimeFile>> FilesOfTimes(const std::string& path);
Result<std::string> FirstFileOf(const std::string& path);
TimeAxis TimesOf(const std::vector<TimeFile>& files);
// The folder or file that says which files there are, and changes when one is added.
std::string ListOfFileTimes(const std::string& path);
// What to say of a time that there is not.
Status NoSuchFileTime(const std::string& path, int time, std::size_t count);

using OpenFileFunction = std::function<Result<std::shared_ptr<VolumeSource>>(const std::string& file, const ReadOptions& options)>;

// The time that `options` name, or the first one; opened by `open`. Without a time, the newest file counts only if it can be opened: it may
// still be written. Errors of FilesOfTimes and `open`; InvalidArgument: there is no such time, none is named and options.describe is false
// though there are several, or a file holds several times itself.
Result<std::shared_ptr<VolumeSource>> OpenFileTimes(const std::string& path, const ReadOptions& options, const OpenFileFunction& open);

}  // namespace slabstream
