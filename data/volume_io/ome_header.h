// The XML of OME: the description of the first page of an OME-TIFF, or a file beside it. The model is that of the OME schema 2016-06, and
// what older ones call otherwise.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "common/base/status.h"
#include "common/volume/field_info.h"
#include "data/volume_io/xml_events.h"

namespace slabstream {

// Which pages some planes of an image are, as a TiffData says.
struct OmeTiffData {
  std::int64_t slice = 0, channel = 0, time = 0;  // FirstZ, FirstC, FirstT
  std::int64_t page = 0;                          // IFD
  std::int64_t count = 0;                         // PlaneCount; 0: all pages of the file
  std::string file_name = {};                     // "": not stated
  std::string uuid = {};                          // the file's UUID
};

struct OmeHeader {
  std::string uuid;                      // the UUID of the file that has this header
  std::string metadata_file;             // BinaryOnly: the file that has the rest; "": this one
  std::vector<std::string> images = {};  // names of all
  XmlTag pixels = {};                    // the chosen image
  std::vector<FieldInfo> channels = {};
  std::vector<OmeTiffData> tiff_data = {};
  bool modulo = false;  // an axis stands for two, such as slices for phases of each
};

// Whether a description is OME's.
bool IsOmeHeader(const std::string& description);

// `image`: which one to read, from 0. InvalidArgument, naming `path`: no XML, or a number in it that is none.
Result<OmeHeader> ReadOmeHeader(const std::string& path, const std::string& description, std::size_t image);

}  // namespace slabstream
