// PageLayout: what the description of a TIFF file says of its pages: slices, channels and times, and where each is.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/base/status.h"
#include "common/math/vec.h"
#include "common/volume/field_info.h"
#include "common/volume/volume.h"
#include "data/volume_io/read_options.h"
#include "data/volume_io/tiff_file.h"

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
  std::vector<FieldInfo> described = {};             // the channels of which it says something, perhaps only the first ones
  std::vector<PageRun> runs = {};                    // empty: planes are the pages of the file, one after the other
  std::vector<std::string> files = {};               // paths; the first one is the file itself
  std::optional<Vec3> spacing = {};                  // the spacing of voxels
  std::optional<LengthUnit> unit = {};               // the unit of the spacing
  ValueMapping rescale = {};                         // from samples to data values
  std::optional<double> time_step = {};              // from a time to the next one, as it is stated
  std::string time_unit = {};                        // the unit of `time_step`, as it is spelled
  std::vector<std::string> notes = {};               // as of SourceInfo

  // The number of a plane in `order`.
  std::int64_t NumberOf(std::int64_t slice, std::int64_t channel, std::int64_t time) const;
  // Whether `runs` name each plane once in `order`; also if one of them has no count.
  bool RunsFit() const;
  std::int64_t planes() const { return slices * channels * times; }
  std::string Text() const;  // "7 slices, 2 channels and 3 times"
};

// What ImageJ and Fiji write into the description of the first page: lines such as channels=2, slices=7, frames=3, spacing=1.5,
// unit=micron.
//
// Whether a description is ImageJ's, or that of ImageJ2 (SCIFIO), which has the same lines.
bool IsImageJHeader(const std::string& description);

// `first`: the file at its first page, whose resolution is the size of pixels; `header`: of this page. InvalidArgument: a number of slices,
// channels or frames out of [1, kMaxVolumes], or another order than three different letters of c, z and t.
Result<PageLayout> ReadImageJHeader(const TiffFile& first, const RawHeader& header, const std::string& description);

// What Python's tifffile writes into the description of the first page: the shape of the array, {"shape": [2, 7, 256, 256], "axes":
// "TZYX"}.
//
// None: the description is not tifffile's, says nothing but the size of a page, or that of another page. Axes without names: z, y and x are
// the last ones; one before them is time, or the channel if `options` take one and no time; two are time and channel. An axis before z that
// is none of them counts as time. InvalidArgument, naming `path`: more axes.
Result<std::optional<PageLayout>> ReadTifffileHeader(const std::string& path, const std::string& description, const RawHeader& page,
                                                     const ReadOptions& options);

// Where the planes of an OME image lie: in the pages of one TIFF file, or of several in one folder.
//
// The description of the first page of a TIFF file, or all of a file of OME metadata (.companion.ome, .ome.xml). Errors of TiffFile::Open
// and ReadTextFile.
Result<std::string> DescriptionIn(const std::string& path);

// `path`: the file that has the description; files that this one names are looked for in its folder, and only there.
// Lengths are converted to micrometres. If there are several images, options.series says which one, from 0; without it,
// the first one is taken. InvalidArgument, naming `path`: no XML; sizes out of [1, kMaxVolumes]; an unknown
// DimensionOrder; an image that is not there. NotFound: the description is in another file, which is missing.
Result<PageLayout> ReadOmeLayout(const std::string& path, const std::string& description, const ReadOptions& options);

}  // namespace slabstream
