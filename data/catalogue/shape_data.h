// A shape's file as the data of a dataset: its bytes (PackShape) stand for voxels, so that they are held, sent to workers and dropped like
// those of a volume. Several files are times of it (data/open/file_times.h): "surf_*.ply", or "surf_*.ply?time=3" for one of them.
#pragma once

#include <string>
#include <vector>

#include "common/base/status.h"
#include "common/shapes/shape.h"
#include "common/volume/field_info.h"
#include "data/catalogue/catalogue.h"

namespace slabstream {

// Whether a source's text names files that hold shapes, and not volumes, by the first of them (HoldsShape). Reads its beginning.
bool NamesShape(const std::string& text);

// The file that a text names, or the first one. InvalidArgument: options other than a time, or no such time. Errors of FilesOfTimes.
struct ShapeFile {
  std::string path;
  TimeAxis times = {};  // of all files; one time if the text names a single file
  int time = 0;
  std::vector<std::string> stamped = {};  // what to watch: it changes when the file changes, or a new one matches
};
Result<ShapeFile> FindShapeFile(const std::string& text);

// Errors of PackShape.
Result<LoadedData> DataOfShape(const Shape& shape);

// Errors of FindShapeFile, ReadShape and PackShape; Unavailable: the file is being written. Any thread.
Result<LoadedSource> LoadShape(const std::string& text, const TellRead& tell);

}  // namespace slabstream
