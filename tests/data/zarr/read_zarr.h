// Reading whole arrays of Zarr, chunk by chunk.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/base/status.h"
#include "data/sources/chunked_array.h"
#include "data/sources/read_context.h"
#include "data/zarr/zarr_array.h"

namespace slabstream {

SourceContext TestContext();

// The array at `path` of a store, or of a folder.
Result<zarr::ZarrArray> OpenTestArray(const std::shared_ptr<Store>& store, const std::string& path = "");
Result<zarr::ZarrArray> OpenTestArray(const std::string& folder, const std::string& path = "");

Result<std::optional<StoredChunk>> ReadChunkNow(ChunkedArray& array, const std::vector<std::uint64_t>& index);

// All elements in the order of the metadata's axes, the last running fastest. Each chunk has the bytes that the array's shape says.
Result<std::vector<double>> ReadElements(const zarr::ZarrArray& array);

}  // namespace slabstream
