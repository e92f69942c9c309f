// Which codec the metadata of an array names. InvalidArgument, naming the codec: it is not supported, or its configuration is wrong.
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "common/base/status.h"
#include "data/codecs/codecs.h"
#include "data/metadata/json_fields.h"
#include "data/volume_io/sample_type.h"

namespace slabstream::zarr {

// Version 2: filters and a compressor, {"id": "zlib", ...}, or null. `type`: of the elements.
Result<CodecChain> ReadFilters(const metadata::Field& filters, const metadata::Field& compressor, SampleType type);

// Version 3: a list of codecs, as far as they concern the elements of one chunk.
struct CodecList {
  std::vector<std::size_t> order;           // axis i of what is stored is the axis order[i] of what goes in
  std::optional<metadata::Field> sharding;  // the configuration of sharding_indexed, which comes last
  CodecChain chain;                         // what is done to bytes
};
Result<CodecList> ReadCodecList(const metadata::Field& codecs, std::size_t axes, SampleType type);

}  // namespace slabstream::zarr
