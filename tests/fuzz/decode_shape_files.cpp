// Files of shapes of every format, read from a file, since that is what the reader takes.
//
// input: u8 the sample (ShapeSamples) whose name the file has, the file
#include "data/shapes/shape_file.h"
#include "tests/data/shapes/shape_samples.h"
#include "tests/fuzz/decoders.h"
#include "tests/support/temporary_directory.h"
#include "tests/support/whole_file.h"

namespace slabstream {

bool DecodeShapeFile(std::span<const std::byte> bytes) {
  static const TemporaryDirectory directory{PlaceOfFuzzFiles()};
  static const std::vector<ShapeSample> samples = ShapeSamples();
  FuzzInput input(bytes);
  const std::string path = directory / samples[input.Take<std::uint8_t>() % samples.size()].name;
  WriteFile(path, std::string(input.Text()));
  const Result<Shape> shape = ReadShape(path);
  if (!shape.ok()) {
    CheckRefusal(shape.status());
    return false;
  }
  CHECK_EQ(WhatIsWrong(*shape), "");
  return true;
}

std::vector<FuzzBytes> ShapeFileSeeds() {
  std::vector<FuzzBytes> seeds;
  for (const ShapeSample& sample : ShapeSamples())
    seeds.push_back(FuzzSeed().Put(std::uint8_t(seeds.size())).Put(std::string_view(sample.bytes)).bytes());
  return seeds;
}

}  // namespace slabstream
