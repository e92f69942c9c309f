// Files to the layers of a volume.
//
// A label volume holds whole numbers in [0, kMaxLabelValue], at most kMaxLabels different ones beside 0. Its colours are those of the table
// that is named; else, of a NIfTI file X.nii or X.nii.gz, those of X.nii.lut beside it, with the names of X.nii.txt (a number and a name in
// each line), as MRIcron has them; else those that the volume itself states (OME-Zarr's image-label); else StandardColor. A label that the
// table does not have has its StandardColor.
//
// Volume and layer must lie in the same kind of world: in the same patient, in the same scene, or both without an orientation.
#pragma once

#include <string>
#include <vector>

#include "common/base/status.h"
#include "common/volume/layers.h"

namespace slabstream {

// "": there is no such layer. Volumes may have options for reading behind a question mark (read_options.h).
struct LayerFiles {
  std::string labels;
  std::string label_colors;  // a table (color_table.h); "": see above
  std::string overlay;

  bool any() const { return !labels.empty() || !overlay.empty(); }
  friend bool operator==(const LayerFiles&, const LayerFiles&) = default;
};

// FILE or FILE:COLOURS, as --labels takes it. A text that is a file's name as a whole is that file. Does not check that the files exist.
void SetLabelFiles(const std::string& text, LayerFiles& files);
// The other way round.
std::string LabelText(const LayerFiles& files);

// Reads headers and the colour table. The files that ReadLayers reads. Errors: as ReadVolume and ReadColorTable; the message begins with
// the layer's name.
Result<std::vector<std::string>> CheckLayerHeaders(const LayerFiles& files);

// The layers at the voxels of `grid`. Errors: of ReadVolume and ReadColorTable; InvalidArgument: values that are no labels, or another
// world; ResourceExhausted: no memory for the samples at the voxels of `grid`. Messages begin with the layer's name and its file.
Result<Layers> ReadLayers(const LayerFiles& files, const VolumeGeometry& grid);

}  // namespace slabstream
