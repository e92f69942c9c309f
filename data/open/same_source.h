// The source of a dataset, opened once more: by another process, or for another purpose.
#pragma once

#include <memory>

#include "common/base/status.h"
#include "common/volume/stored_at.h"
#include "data/sources/source_format.h"

namespace slabstream {

// The source there, if it is what the coordinator has. Unavailable: it is another one. Errors of ParseSourceText and OpenSource. Waits.
Result<std::shared_ptr<VolumeSource>> OpenSameSource(const StoredAt& stored, const SourceContext& context);

}  // namespace slabstream
