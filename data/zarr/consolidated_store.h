// A store whose root holds the metadata of all nodes ("consolidated" metadata: `.zmetadata` of version 2, a member of zarr.json of version
// 3): it answers for them without asking, and lists folders even where the store behind it cannot.
#pragma once

#include <memory>

#include "data/stores/store.h"

namespace slabstream::zarr {

// `store` itself if there are none, or none that can be read. Waits.
std::shared_ptr<Store> WithConsolidatedMetadata(std::shared_ptr<Store> store);

}  // namespace slabstream::zarr
