// The store of a source.
#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include "data/sources/source_format.h"
#include "data/stores/store.h"
#include "data/volume_io/read_options.h"

namespace slabstream {

// OpenStore, for sources of this context.
inline Result<std::shared_ptr<Store>> OpenStoreFor(const SourceContext& context, const std::string& path, const ReadOptions& options) {
  if (std::error_code error; options.follow_links && std::filesystem::is_directory(path, error))
    return FolderStore(path, Links::kMayLeadOut);
  return OpenStore(path, context->only_keeps() ? KeptObjects::kAreTaken : KeptObjects::kAreChecked);
}

}  // namespace slabstream
