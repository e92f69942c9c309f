// Files as times: "run/cell_*.tif" is one source with a time for each file, in natural order of their names ("cell_2" before "cell_10"),
// and so is a file that names a file for each time, as VTK's writers and simulations make them beside their output: ParaView's collections
// (.pvd, XML) and series (.vti.series, JSON). Microscopes and simulations write a file for each time, while somebody looks.
#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "common/base/status.h"
#include "common/volume/field_info.h"
#include "data/sources/volume_source.h"
#include "data/volume_io/read_options.h"

namespace slabstream {

struct TimeFile {
  std::string file;
  double time = 0;
};

inline constexpr std::size_t kMaxFileTimes = 100'000;

// Whether the path names a series, or is a pattern: its last part has a '*', which stands for any characters, and there is no file of that
// name.
bool NamesFileTimes(const std::string& path);

// The files of such a path, in order of their times, which are the numbers of the files if the path is a pattern; never none. NotFound:
// there is none. ResourceExhausted: more than kMaxFileTimes. InvalidArgument, naming `path`: no such file of times, one without a file or
// with more than kMaxFileTimes, a time that is no number, two files of one time, or a series that names another one.
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
