// Files that name a file for each time, as VTK's writers and simulations make them beside their output: ParaView's collections (.pvd, XML)
// and series (.vti.series, JSON).
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "common/base/status.h"

namespace slabstream {

struct TimeFile {
  std::string file;
  double time = 0;
};

// By the ending.
bool IsSeriesFile(const std::string& path);

// By ascending times. NotFound: no such file. InvalidArgument, naming `path`: no such file of times, one without a file or with more than
// `most`, a time that is no number, or two files of one time.
Result<std::vector<TimeFile>> ReadSeriesFile(const std::string& path, std::size_t most);

}  // namespace slabstream
