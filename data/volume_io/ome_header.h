// What an OME-TIFF says of its pages: the XML in the description of the first one.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/base/status.h"
#include "common/math/vec.h"
#include "data/volume_io/read_options.h"

namespace slabstream {

// The slices of a volume among the pages of a file: first, first + step, ...
struct PageOrder {
  std::int64_t first = 0, step = 1, count = 0;
  bool of_channel = false;                 // these are the pages of one channel of several
  std::optional<Vec3> spacing;             // micrometres
  int channel = 0;                         // which one
  std::vector<std::string> channels = {};  // names, "" where there is none; as many as there are channels if these have pages
  int times = 1;                           // that the file holds

  std::int64_t PageOf(std::int64_t slice) const { return first + slice * step; }
};

// Whether a description is OME's.
bool IsOmeHeader(const std::string& description);

// InvalidArgument, naming `path`: several times, of which the options do not take one; a channel that is not there; sizes that do not fit
// the number of pages; several images; or no XML.
Result<PageOrder> ReadOmeHeader(const std::string& path, const std::string& description, std::int64_t pages, const ReadOptions& options);

}  // namespace slabstream
