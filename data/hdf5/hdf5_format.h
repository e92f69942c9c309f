// HDF5 files as sources: pyramids of Imaris and BigDataViewer, adaptive meshes and grids of VTKHDF and FLASH, and datasets as images
// (hdf5_image.h).
#pragma once

#include "data/volume_io/formats.h"

namespace slabstream {

VolumeFormat Hdf5();

}  // namespace slabstream
