// N5 containers: attributes of a dataset, and one of its blocks.
//
// input: attributes.json without line feeds, a line feed, the block at the beginning of each axis
#include <fmt/format.h>

#include "tests/data/volume_io/volume_files.h"
#include "tests/fuzz/decoders.h"
#include "tests/fuzz/read_source.h"

namespace slabstream {

bool DecodeN5Container(std::span<const std::byte> bytes) {
  FuzzInput input(bytes);
  const std::string path = PathOfSource("scan.n5");
  std::filesystem::create_directories(path + "/0/0");
  WriteFile(path + "/attributes.json", FileBytes(input.TakeLine()));
  WriteFile(path + "/0/0/0", FileBytes(input.Text()));
  return ReadSource(path, {});
}

std::vector<FuzzBytes> N5ContainerSeeds() {
  std::vector<FuzzBytes> seeds;
  const FileBytes samples(2 * 3 * 4 * 2, 'x');
  for (const std::string compression : {"raw", "gzip"}) {
    for (const int mode : {0, 1}) {
      const std::string attributes = fmt::format(R"({{"dimensions": [3, 2, 4], "blockSize": [3, 2, 5], "dataType": "uint16",)"
                                                 R"( "compression": {{"type": "{}"}}, "resolution": [4, 4, 40], "units": ["nm"]}})",
                                                 compression);
      FuzzSeed seed;
      seed.Put(attributes).Put("\n");
      for (const int byte : {0, mode, 0, 3, 0, 0, 0, 3, 0, 0, 0, 2, 0, 0, 0, 4}) seed.Put(std::uint8_t(byte));
      if (mode == 1) seed.Put(std::uint8_t{0}).Put(std::uint8_t{0}).Put(std::uint8_t{0}).Put(std::uint8_t{24});
      seeds.push_back(seed.Put(compression == "raw" ? samples : Gzip(samples)).bytes());
    }
  }
  return seeds;
}

}  // namespace slabstream
