// What `convert` reads: SOURCE, or a box of one of its levels.
#pragma once

#include <memory>

#include "client/cli/options.h"
#include "data/sources/read_context.h"
#include "data/sources/volume_source.h"

namespace slabstream {

// In parts if its format allows that, else as a whole. Errors of reading it (AsInput); InvalidArgument: it has no such level or voxels; the
// message says which it has.
Result<std::shared_ptr<VolumeSource>> OpenToConvert(const ConvertOptions& options, const SourceText& source,
                                                    const ReadContext::Limits& limits);

}  // namespace slabstream
