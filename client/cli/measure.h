// `measure`: lengths and angles in a dataset's world, values along a line, and of the voxels in a box or of each label.
#pragma once

#include <string>
#include <vector>

#include "client/cli/options.h"
#include "common/base/status.h"
#include "data/layers/layer_reader.h"

namespace slabstream {

// Texts as measure.cpp parses them; points are X,Y,Z of the world, separated by ':'.
struct MeasureOptions {
  ConnectionOptions connection;
  std::string source;                  // a name of the catalogue; a path with local_workers > 0
  std::vector<std::string> distances;  // two points
  std::vector<std::string> angles;     // three points; the angle is at the second one
  std::vector<std::string> profiles;   // two points
  std::vector<std::string> boxes;      // as ParseClipBox takes them
  bool labels = false;                 // the voxels of each label
  LayerFiles layers;                   // the labels, with local_workers > 0
  int samples = 0;                     // samples of each profile, [2, kMaxSamplePoints]; 0: one for each voxel that the line passes
  bool json = false;
  bool csv = false;  // for labels, and for nothing else
};

Status RunMeasure(const MeasureOptions& options);

}  // namespace slabstream
