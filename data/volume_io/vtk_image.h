// Parallel structured grids of VTK's XML files (.pvti, .pvtr): a file that names the files of the pieces.
//
// Any thread.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "common/base/status.h"
#include "common/volume/box.h"
#include "data/volume_io/raw_volume.h"
#include "data/volume_io/read_options.h"

namespace slabstream {

struct ParallelImage {
  struct Piece {
    std::string file;
    Box box;  // of the whole grid's voxels, by the axes of the files. Not empty; pieces may overlap
  };
  RawHeader header;               // of the whole grid
  std::string array;              // the one that options.array takes
  std::string_view piece_format;  // the name of the format of the pieces' files
  std::vector<Piece> pieces;
};

// Reads the header, and of a rectilinear grid the coordinates in the pieces' files. Errors as of VolumeFormat::locate.
Result<ParallelImage> ReadParallelImage(const std::string& path, const ReadOptions& options);

}  // namespace slabstream
