// Parts of `convert`: what it reads, SOURCE or a box of one of its levels; and writing into a folder, an OME-Zarr with levels.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "client/cli/options.h"
#include "common/base/status.h"
#include "data/sources/read_context.h"
#include "data/sources/volume_source.h"
#include "data/volume_io/read_options.h"

namespace slabstream {

struct SourceToConvert {
  std::shared_ptr<VolumeSource> source;
  std::uint64_t memory = 0;  // bytes that it holds
};

// Errors of opening it; InvalidArgument: it has no such level or voxels; the message says which it has.
Result<SourceToConvert> OpenToConvert(const ConvertOptions& options, const SourceText& source, const ReadContext::Limits& limits);

// Whether `output` ends in .zarr.
bool NamesZarr(const std::string& output);

// `source` is what options.source says. A source that can be read in parts is never in memory as a whole. A first Ctrl-C ends it with
// Cancelled, so that the same command goes on later.
Status ConvertToZarr(const ConvertOptions& options, const SourceText& source);

}  // namespace slabstream
