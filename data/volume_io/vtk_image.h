// Structured grids of VTK's XML files in several files: a file that names the files of the pieces (.pvti, .pvtr), or of blocks that are
// images or rectilinear grids, or pieces of them (vtk_list.h).
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
  std::vector<std::string> lists = {};  // files that name pieces, beside the path that is read
};

// Reads the header, and of a rectilinear grid the coordinates in the pieces' files. `type`: one of kVtkImageTypes; of a file without others
// the only piece is the file. Errors as of VolumeFormat::locate.
Result<ParallelImage> ReadParallelImage(const std::string& path, std::string_view type, const ReadOptions& options);

// The same of blocks, for which the header of each is read. They have one lattice: the same steps, apart by whole voxels, and the same
// coordinates along uneven axes. InvalidArgument: they have not, or some are no images.
Result<ParallelImage> ReadImageBlocks(const std::string& path, const ReadOptions& options);

}  // namespace slabstream
