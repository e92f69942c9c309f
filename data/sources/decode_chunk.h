// How an array gets from what its store answered to a chunk: on a thread that decodes, so that those of stores stay free to read.
#pragma once

#include <cstdint>
#include <string>

#include "common/base/status.h"
#include "common/memory/bytes.h"
#include "data/codecs/codec.h"
#include "data/sources/chunked_array.h"
#include "data/sources/read_context.h"

namespace slabstream {

// Calls `done` exactly once: on a decoding thread with `bytes` decoded bytes, or at once if there is nothing to decode.
// NotFound as the answer means that the chunk is not there; other failures pass. In a context that only keeps, no chunk
// is there. `what` names store and object in messages of damage. ResourceExhausted: no memory. `chain` and `what` are
// kept until then. Any thread.
void DecodeOn(const SourceContext& context, CodecChain chain, Result<Bytes> answer, std::uint64_t bytes, std::string what,
              ChunkedArray::ChunkDone done);

}  // namespace slabstream
