// What `convert` reads: SOURCE, or a box of one of its levels.
#pragma once

#include <cstdint>
#include <memory>

#include "client/cli/options.h"
#include "data/sources/read_context.h"
#include "data/sources/volume_source.h"

namespace slabstream {

struct SourceToConvert {
  std::shared_ptr<VolumeSource> source;
  std::uint64_t memory = 0;  // bytes that it holds
};

// Errors of opening it (AsInput); InvalidArgument: it has no such level or voxels; the message says which it has.
Result<SourceToConvert> OpenToConvert(const ConvertOptions& options, const SourceText& source, const ReadContext::Limits& limits);

}  // namespace slabstream
