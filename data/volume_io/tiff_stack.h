// TiffStack: the pages of a TIFF file, or of the files of an OME-TIFF, that are the slices of a volume.
#pragma once

#include <string>
#include <vector>

#include "data/volume_io/tiff_file.h"

namespace slabstream {

struct TiffSlice {
  std::size_t file = 0;                     // in TiffStack::files
  std::uint64_t directory = 0;              // its place there
  std::int64_t page = 0;                    // its number among all directories there
  std::int64_t plane = 0;                   // TiffChunk::plane
  std::vector<std::uint64_t> smaller = {};  // places of its pictures at lower resolutions
};

struct TiffStack {
  std::vector<std::string> files;  // paths of those that are used
  std::vector<TiffSlice> slices;
  RawHeader header;      // the volume's header, as the first slice says
  ReadOptions of_pages;  // what the options say of a page's components

  // "a.tif: page 8", counted from 1, for messages.
  std::string NameOf(const TiffSlice& slice) const;
};

// Reads the directories of all pages. `path` may also be the metadata of an OME-TIFF (.companion.ome).
// InvalidArgument: there is one slice only, several times of which the options take none, a channel that is not there, pages that do not
// fit what the file says of them; errors of TiffFile::ReadHeader, ReadOmeLayout and HeaderOfSlices. NotFound: a file of a set is missing.
// DataLoss.
Result<TiffStack> OpenTiffStack(const std::string& path, const ReadOptions& options);

// How many files the OME-TIFF has that `path` belongs to; 1 if it stands alone or cannot be read.
std::size_t FilesOf(const std::string& path);

}  // namespace slabstream
