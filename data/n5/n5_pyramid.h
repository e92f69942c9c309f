// The volume of an N5 container.
#pragma once

#include <memory>

#include "common/base/status.h"
#include "data/sources/chunked_source.h"
#include "data/sources/source_format.h"
#include "data/stores/store.h"

namespace slabstream::n5 {

inline constexpr const char* kAttributes = "attributes.json";

// Errors of SourceFormat::open.
Result<Pyramid> OpenPyramid(const std::shared_ptr<Store>& store, const ReadOptions& options, const SourceContext& context);

}  // namespace slabstream::n5
