// An array of a Zarr hierarchy as a ChunkedArray.
#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include "common/base/status.h"
#include "data/sources/chunked_array.h"
#include "data/sources/read_context.h"
#include "data/stores/store.h"
#include "data/zarr/shard_indices.h"
#include "data/zarr/zarr_node.h"

namespace slabstream::zarr {

struct ZarrArray {
  std::shared_ptr<ChunkedArray> array;
  std::vector<std::size_t> from;             // axis i of `array` is the axis from[i] of the metadata
  std::vector<std::string> dimension_names;  // names of the axes of `array`, "" where there is none; empty: there are none at all
};

// What the arrays of a source share.
struct ArrayContext {
  std::shared_ptr<Store> store;
  SourceContext source;
  std::shared_ptr<ShardIndices> indices;
};
ArrayContext MakeArrayContext(std::shared_ptr<Store> store, SourceContext source);

// `node` is an array. InvalidArgument: its metadata are wrong, or need something that is not supported.
Result<ZarrArray> OpenArray(const ArrayContext& context, const ZarrNode& node);

}  // namespace slabstream::zarr
