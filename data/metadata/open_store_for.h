// The store of a source.
#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include "data/sources/source_format.h"
#include "data/stores/store.h"
#include "data/volume_io/read_options.h"

namespace slabstream {

// The store that the options hold, else a folder whose links are followed if they say so, else OpenStore for sources of this context.
inline Result<std::shared_ptr<Store>> OpenStoreFor(const SourceContext& context, const std::string& path, const ReadOptions& options) {
  if (options.store != nullptr) return options.store;
  if (std::error_code error; options.follow_links && std::filesystem::is_directory(path, error))
    return FolderStore(path, Links::kMayLeadOut);
  const auto kept = context->only_keeps() ? WebOptions::Kept::kAreTaken : WebOptions::Kept::kAreChecked;
  return OpenStore(path, {.kept = kept, .query = options.query, .headers = options.headers});
}

}  // namespace slabstream
