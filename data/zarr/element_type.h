// Types of elements and their fill values, as the metadata of Zarr write them. Errors: InvalidArgument, naming the field.
#pragma once

#include <cstddef>
#include <vector>

#include "common/base/status.h"
#include "data/metadata/json_fields.h"
#include "data/volume_io/sample_type.h"

namespace slabstream::zarr {

struct ElementType {
  SampleType type = SampleType::kUint8;
  bool swapped = false;  // in the other byte order than this machine's
};

// Version 2: as NumPy writes types, such as "<u2". Truth values are 0 and 1 of uint8.
Result<ElementType> ReadDtype(const metadata::Field& dtype);
// Version 3: "uint16".
Result<SampleType> ReadDataType(const metadata::Field& data_type);

// One element in this machine's byte order: a number, null (0), true, false, or a number as a text, such as "0"; of floats also "NaN",
// "Infinity", "-Infinity", or their bits in hexadecimal such as "0x7fc00000".
Result<std::vector<std::byte>> ReadFill(const metadata::Field& fill, SampleType type);

}  // namespace slabstream::zarr
