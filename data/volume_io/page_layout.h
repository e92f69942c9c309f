// PageLayout: what the description of a TIFF file says of its pages: slices, channels and times, and where each is.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/math/vec.h"
#include "common/volume/summary.h"
#include "common/volume/volume.h"

namespace slabstream {

// Planes that follow each other in a PageLayout's order and are pages that follow each other in a file.
struct PageRun {
  std::int64_t slice = 0, channel = 0, time = 0;  // where the first plane belongs
  std::int64_t count = 0;                         // 0: as many as the file has pages from `page` on
  std::int64_t page = 0;                          // number of the first one among all directories of the file's chain
  std::size_t file = 0;                           // in PageLayout::files

  friend bool operator==(const PageRun&, const PageRun&) = default;
};

struct PageLayout {
  std::string source;                                // the program that says so, for people: "ImageJ"
  std::int64_t slices = 1, channels = 1, times = 1;  // each in [1, kMaxVolumes]
  std::string order = "CZT";                         // which runs fastest from plane to plane, which next
  std::vector<std::string> channel_names = {};       // those that it says
  std::vector<PageRun> runs = {};                    // empty: planes are the pages of the file, one after the other
  std::vector<std::string> files = {};               // paths; the first one is the file itself
  std::optional<Vec3> spacing = {};                  // the spacing of voxels
  std::optional<LengthUnit> unit = {};               // the unit of the spacing
  ValueMapping rescale = {};                         // from samples to data values
  std::optional<ValueRange> window = {};             // data values that its author shows
  std::vector<std::string> notes = {};               // as of SourceInfo

  // The number of a plane in `order`.
  std::int64_t NumberOf(std::int64_t slice, std::int64_t channel, std::int64_t time) const;
  // Whether `runs` name each plane once in `order`; also if one of them has no count.
  bool RunsFit() const;
  std::int64_t planes() const { return slices * channels * times; }
  std::string Text() const;  // "7 slices, 2 channels and 3 times"
};

}  // namespace slabstream
