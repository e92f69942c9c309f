// The store of a source.
#pragma once

#include <memory>
#include <string>

#include "data/sources/source_format.h"
#include "data/stores/store.h"

namespace slabstream {

// OpenStore, for sources of this context.
inline Result<std::shared_ptr<Store>> OpenStoreFor(const SourceContext& context, const std::string& path) {
  return OpenStore(path, context->only_keeps() ? KeptObjects::kAreTaken : KeptObjects::kAreChecked);
}

}  // namespace slabstream
