// TIFF files of kinds that WriteTiff (volume_files.h) does not write.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "common/math/vec.h"
#include "tests/data/volume_io/volume_files.h"

namespace slabstream {

struct TiffKind {
  int bits = 8, components = 1;
  int format = 1, photometric = 1, planar = 1, orientation = 1, compression = 1, predictor = 1;  // numbers of tiff.h
  int tile = 0;                                                                                  // pixels a side; 0: strips of two rows
  bool big_endian = false;
};
using TiffSample = std::function<std::uint64_t(int x, int y, int z, int component)>;
// A page for each slice. Samples of other than 8, 16, 32 and 64 bits are packed, the highest bit first.
void WriteTiffKind(const std::string& path, const Index3& size, const TiffKind& kind, const TiffSample& sample);

// One directory, of the first picture, in front of all samples, which are `bits` long and in the file's byte order: as ImageJ writes stacks
// above 4 GiB. `entries`: what ImageJ keeps beside the description, in pieces of so many bytes.
struct ImageJEntries {
  std::vector<std::uint32_t> sizes = {};
  FileBytes bytes = {};
};
FileBytes OneDirectoryTiff(const Index3& size, int bits, bool big_endian, const std::string& description, const FileBytes& samples,
                           const ImageJEntries& entries = {});
// Entries of these windows and lookup tables, which end with these colours.
ImageJEntries LooksOfImageJ(bool big_endian, const std::vector<double>& windows, const std::vector<std::array<int, 3>>& tables);

// OME's XML of one image of uint8, 4 x 3 pixels: the attributes of its Pixels, and what they hold.
std::string OmeXml(const std::string& pixels, const std::string& inside, const std::string& uuid = "");

}  // namespace slabstream
