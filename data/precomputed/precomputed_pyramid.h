// The volume that an info file describes.
#pragma once

#include <memory>

#include "common/base/status.h"
#include "data/sources/chunked_source.h"
#include "data/sources/source_format.h"
#include "data/stores/store.h"

namespace slabstream::precomputed {

inline constexpr const char* kInfo = "info";

// Errors of SourceFormat::open.
Result<Pyramid> OpenPyramid(const std::shared_ptr<Store>& store, const ReadOptions& options, const SourceContext& context);

}  // namespace slabstream::precomputed
