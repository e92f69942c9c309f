// The volume of an N5 container.
#pragma once

#include <memory>

#include "common/base/status.h"
#include "data/sources/chunked_source.h"
#include "data/sources/read_context.h"
#include "data/stores/store.h"
#include "data/volume_io/read_options.h"

namespace slabstream::n5 {

// Errors of VolumeFormat::open.
Result<Pyramid> OpenPyramid(const std::shared_ptr<Store>& store, const ReadOptions& options, const SourceContext& context);

}  // namespace slabstream::n5
