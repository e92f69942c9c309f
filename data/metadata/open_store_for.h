// The store of a source.
#pragma once

#include <memory>
#include <string>

#include "data/sources/source_format.h"
#include "data/stores/store.h"

namespace slabstream {

// The store that the options hold, else OpenStore for sources of this context.
inline Result<std::shared_ptr<Store>> OpenStoreFor(const SourceContext& context, const std::string& path, const ReadOptions& options) {
  if (options.store != nullptr) return options.store;
  const auto kept = context->only_keeps() ? WebOptions::Kept::kAreTaken : WebOptions::Kept::kAreChecked;
  return OpenStore(path, {.kept = kept, .query = options.query, .headers = options.headers});
}

}  // namespace slabstream
