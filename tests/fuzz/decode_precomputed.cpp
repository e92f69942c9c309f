// Neuroglancer's precomputed volumes: the info file, and one chunk.
//
// input: the info without line feeds, a line feed, the chunk s/0-4_0-4_0-4
#include <fmt/format.h>

#include "tests/data/volume_io/more_files.h"
#include "tests/data/volume_io/volume_files.h"
#include "tests/fuzz/decoders.h"
#include "tests/fuzz/read_source.h"

namespace slabstream {
bool DecodePrecomputed(std::span<const std::byte> bytes) {
  FuzzInput input(bytes);
  const std::string path = PathOfSource("em");
  std::filesystem::create_directories(path + "/s");
  WriteFile(path + "/info", FileBytes(input.TakeLine()));
  WriteFile(path + "/s/0-4_0-4_0-4", FileBytes(input.Text()));
  return ReadSource(path, {});
}

std::vector<FuzzBytes> PrecomputedSeeds() {
  std::vector<FuzzBytes> seeds;
  const auto add = [&](const std::string& type, const std::string& encoding, const FileBytes& chunk) {
    const std::string info = fmt::format(R"({{"type": "image", "data_type": "{}", "num_channels": 1,)"
                                         R"( "scales": [{{"key": "s", "size": [4, 4, 4], "chunk_sizes": [[4, 4, 4]],)"
                                         R"( "resolution": [4, 4, 40], "voxel_offset": [0, 0, 0], {}}}]}})",
                                         type, encoding);
    seeds.push_back(FuzzSeed().Put(info).Put("\n").Put(chunk).bytes());
  };
  add("uint16", R"("encoding": "raw")", FileBytes(128, 'x'));
  add("uint16", R"("encoding": "raw")", Gzip(FileBytes(128, 'x')));
  WriteJpeg(PathOfSource("seed.jpg"), {8, 8, 1}, 1, FileBytes(64, 'x'));
  add("uint8", R"("encoding": "jpeg")", ReadFile(PathOfSource("seed.jpg")));
  FileBytes labels(4 * (1 + 2 + 2 + 2), '\0');  // a channel with a block, of 1 bit for each voxel and a table of two labels
  const std::uint8_t header[] = {1, 0, 0, 0, 4, 0, 0, 1, 2, 0, 0, 0};
  std::copy(std::begin(header), std::end(header), labels.begin());
  labels[4 * 3] = '\x55';
  add("uint32", R"("encoding": "compressed_segmentation", "compressed_segmentation_block_size": [4, 4, 4])", labels);
  return seeds;
}

}  // namespace slabstream
