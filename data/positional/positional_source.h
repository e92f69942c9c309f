// Volumes in one file, or a header and one file, whose samples lie there uncompressed, one after the other: raw, NRRD, MetaImage, NIfTI,
// MGH, MRC, VTK images with raw appended samples, and arrays of NumPy. They are read by position: of a box, only what it needs.
//
// The volume is that of ReadVolume (volume_reader.h): the same voxels in the same axes, turned to those nearest to the world's. Its
// description differs in one thing: integers of more than 16 bits and float64 always become float32, since nobody has seen all values.
//
// Not read by position, so that `open` ends in InvalidArgument: compressed samples or samples in several files, axes that are not
// at right angles, and the luminance of several components.
#pragma once

#include "data/sources/source_format.h"

namespace slabstream {

// Recognises a path by its ending and its header; raw samples by their ending alone.
SourceFormat UncompressedFile();

}  // namespace slabstream
