// What `convert` reads: SOURCE, or a box of one of its levels.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>

#include "client/cli/options.h"
#include "client/cli/progress_bar.h"
#include "data/sources/read_context.h"
#include "data/sources/volume_source.h"
#include "data/zarr_writer/ome_zarr_writer.h"

namespace slabstream {

struct SourceToConvert {
  std::shared_ptr<VolumeSource> source;
  std::optional<SliceOrder> slices = {};  // the order of slices in a compressed stream
  std::uint64_t memory = 0;               // bytes that it holds
};

// In parts if its format allows that, or slice by slice, else as a whole; a box of a stream, too. `bar` shows what is read as a whole.
// Errors of reading it (AsInput); InvalidArgument: it has no such level or voxels; the message says which it has.
Result<SourceToConvert> OpenToConvert(const ConvertOptions& options, const SourceText& source, const ReadContext::Limits& limits,
                                      ProgressBar& bar);

}  // namespace slabstream
