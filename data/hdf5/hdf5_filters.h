// The filters of HDF5 as codecs.
#pragma once

#include <cstddef>
#include <vector>

#include "common/base/status.h"
#include "data/codecs/codec.h"
#include "data/hdf5/hdf5_file.h"

namespace slabstream {

// One codec a filter, in their order. InvalidArgument, naming the filter: it is not supported. `named`: the beginning of the message.
Result<CodecChain> CodecsOf(const std::vector<Hdf5Filter>& filters, std::size_t element_bytes, const std::string& named);

}  // namespace slabstream
