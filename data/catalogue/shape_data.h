// A shape's file as the data of a dataset: its bytes (PackShape) stand for voxels, so that they are held, sent to workers and dropped like
// those of a volume.
#pragma once

#include <string>

#include "common/base/status.h"
#include "common/shapes/shape.h"
#include "data/catalogue/catalogue.h"

namespace slabstream {

// Errors of PackShape.
Result<LoadedData> DataOfShape(const Shape& shape);

// Errors of ReadShape and PackShape; Unavailable: the file is being written. Any thread.
Result<LoadedSource> LoadShape(const std::string& path, const TellRead& tell);

}  // namespace slabstream
