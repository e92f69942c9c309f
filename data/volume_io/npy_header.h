// The header of an array of NumPy (.npy), by numpy.lib.format, versions 1 to 3.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "common/base/status.h"
#include "data/volume_io/sample_type.h"

namespace slabstream {

struct NpyHeader {
  SampleType type = SampleType::kUint8;
  bool big_endian = false;
  bool fortran = false;       // the first index runs fastest
  std::vector<double> shape;  // whole numbers
  std::int64_t end = 0;       // the byte of the file where samples begin
};

// InvalidArgument: it is no such array, or one of a type that is no number. Messages begin with the path. NotFound, DataLoss.
Result<NpyHeader> ReadNpyHeader(const std::string& path);

}  // namespace slabstream
