// A dataset of an HDF5 file as a ChunkedArray: chunks are read by position, many at a time, and decoded by our own codecs.
#pragma once

#include <memory>
#include <optional>

#include "common/base/status.h"
#include "data/hdf5/hdf5_file.h"
#include "data/sources/chunked_array.h"
#include "data/sources/read_context.h"

namespace slabstream {

// `as`: what its samples are taken for, of as many bytes as their type; nullopt: what the file says. `size`: how much of the dataset is
// meant, along each axis; empty: all. Reads compact datasets at once. InvalidArgument: one of the filters is not supported, which the
// message names; the size is that of another number of axes, or above the dataset's. DataLoss.
Result<std::shared_ptr<ChunkedArray>> MakeHdf5Array(std::shared_ptr<Hdf5Dataset> dataset, const SourceContext& context,
                                                    std::optional<SampleType> as = std::nullopt, std::vector<std::uint64_t> size = {});

}  // namespace slabstream
