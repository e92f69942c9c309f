// The store of a source.
#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include "data/stores/store.h"
#include "data/volume_io/read_options.h"

namespace slabstream {

// The store that the options hold, else a folder whose links are followed if they say so, else OpenStore.
inline Result<std::shared_ptr<Store>> OpenStoreFor(const std::string& path, const ReadOptions& options) {
  if (options.store != nullptr) return options.store;
  if (std::error_code error; options.follow_links && std::filesystem::is_directory(path, error))
    return FolderStore(path, Links::kMayLeadOut);
  return OpenStore(path, {.query = options.query, .headers = options.headers});
}

}  // namespace slabstream
