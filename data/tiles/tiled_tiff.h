// TIFF, BigTIFF and OME-TIFF files as sources: each slice is a page (tiff_stack.h), and its tiles, or some strips, are chunks. Smaller
// pictures of the pages are the coarser levels: their sub-directories (SubIFDs, as OME-TIFF and Bio-Formats write them), or pages of
// reduced resolution that follow them.
//
// The volume is that of ReadVolume, with one difference (chunked_source.h): integers of more than 16 bits and float64 become float32. The
// corners of all levels coincide.
#pragma once

#include "data/sources/source_format.h"

namespace slabstream {

// Recognises files by their ending. Folders of slices are not its own. `open` reads the directories of all pages. InvalidArgument, too: the
// luminance of several components.
SourceFormat TiledTiff();

}  // namespace slabstream
