// TiffStack: the pages of a TIFF file that are the slices of a volume.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "data/volume_io/tiff_file.h"

namespace slabstream {

struct TiffStack {
  std::unique_ptr<TiffFile> file;
  std::vector<TiffPage> pages;  // of the file, all of them
  PageOrder order;              // which of them are the slices
  RawHeader header;             // of the volume, as the first page says
  ReadOptions of_pages;         // what the options say of a page's components
};

// InvalidArgument: there is one slice only, or errors of TiffFile::ReadHeader, ReadOmeHeader and HeaderOfSlices. DataLoss, NotFound.
Result<TiffStack> OpenTiffStack(const std::string& path, const ReadOptions& options);

}  // namespace slabstream
