// Files of shapes: meshes, lines and points. The only list of formats is in shape_file.cpp.
#pragma once

#include <string>

#include "common/base/status.h"
#include "common/shapes/shape.h"
#include "data/volume_io/read_progress.h"

namespace slabstream {

// Whether a file holds a shape, and not a volume: by its ending, or by its first bytes where an ending may mean either (.vtk, .npy) or
// nothing (lh.pial). Reads the beginning of the file. False: it does not, or cannot be read.
bool HoldsShape(const std::string& path);
std::string ShapeEndings();  // for messages: ".csv, .glb, ..."

// Coordinates of files that say so (LPS, a FreeSurfer surface's own axes, a tractogram's voxels) become those of the patient (RAS); all
// others stay as they are. `tell`, if any, hears how much of the file has been read (of VTK's and NumPy's nothing). NotFound: no such file.
// InvalidArgument, DataLoss: it is not one of a known format, truncated, or says what cannot be: each message names the file, the field,
// the value and the limit. ResourceExhausted: it does not fit the memory, known before memory is taken.
Result<Shape> ReadShape(const std::string& path, const TellRead& tell = {});

}  // namespace slabstream
