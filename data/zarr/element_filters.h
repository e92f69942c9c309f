// Filters of numcodecs, which change elements before they become bytes: what a decoder makes of them.
#pragma once

#include <string_view>

#include "common/base/status.h"
#include "data/codecs/codec.h"
#include "data/metadata/json_fields.h"
#include "data/volume_io/sample_type.h"

namespace slabstream::zarr {

bool IsElementFilter(std::string_view name);  // "delta"

struct ElementFilter {
  CodecChain chain;
  SampleType stored = SampleType::kUint8;  // the type of the elements behind it
};

// `settings`: the members `dtype`, `astype` and so on. `type`: of the elements that go in. `swaps`: elements are in the byte order that
// dtype and astype state, else in this machine's. InvalidArgument, naming the field: it is wrong, or dtype is not `type`.
Result<ElementFilter> ReadElementFilter(std::string_view name, const metadata::Field& settings, SampleType type, bool swaps);

}  // namespace slabstream::zarr
