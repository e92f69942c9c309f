// A dataset of an N5 container as a ChunkedArray. N5 counts axes from the fastest one, so they are the other way round here. Source:
// https://github.com/saalfeldlab/n5#file-system-specification
#pragma once

#include <memory>
#include <string>

#include "common/base/status.h"
#include "data/metadata/json_fields.h"
#include "data/sources/chunked_array.h"
#include "data/sources/read_context.h"
#include "data/stores/store.h"

namespace slabstream::n5 {

// `attributes`: of the dataset at `path` of the store. InvalidArgument: they are wrong, or a type or compression is not supported, which
// the message names. ResourceExhausted: blocks of more than kMostChunkBytes.
Result<std::shared_ptr<ChunkedArray>> OpenArray(const std::shared_ptr<Store>& store, const std::string& path,
                                                const metadata::Field& attributes, const SourceContext& context);

// The elements of a stored block behind its header, still packed. `size`: along each axis of N5. DataLoss: damaged, or larger than `most`
// along an axis.
struct Block {
  std::vector<std::uint64_t> size;
  Bytes packed;
};
Result<Block> ParseBlock(const Bytes& stored, const std::vector<std::uint64_t>& most);

}  // namespace slabstream::n5
