// The store of a source, and sources in stores.
#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include "common/text/url.h"
#include "data/sources/chunked_source.h"
#include "data/sources/read_context.h"
#include "data/stores/store.h"
#include "data/stores/watched_object.h"
#include "data/volume_io/read_options.h"

namespace slabstream {

// The store that the options hold, else a folder whose links are followed if they say so, else OpenStore.
inline Result<std::shared_ptr<Store>> OpenStoreFor(const std::string& path, const ReadOptions& options) {
  if (options.store != nullptr) return options.store;
  if (std::error_code error; options.follow_links && std::filesystem::is_directory(path, error))
    return FolderStore(path, Links::kMayLeadOut);
  return OpenStore(path, {.query = options.query, .headers = options.headers});
}

// Behind an address the shape of the finest array tells that times have come. `array_key`: of the object that was read for it.
inline void FollowTimes(const std::shared_ptr<Store>& store, const std::string& array_key, const ReadOptions& options, Pyramid& pyramid) {
  if (options.time || pyramid.levels.front().time_axis < 0 || !IsUrl(store->name())) return;
  pyramid.info.growth = WatchObject(store, array_key);
}

using OpenPyramidFunction = Result<Pyramid> (*)(const std::shared_ptr<Store>& store, const ReadOptions& options,
                                                const SourceContext& context);
// VolumeFormat::open of a format of chunks in a store.
template <OpenPyramidFunction kOpen>
Result<std::shared_ptr<VolumeSource>> OpenInStore(const std::string& path, const ReadOptions& options, const SourceContext& context) {
  const Result<std::shared_ptr<Store>> store = OpenStoreFor(path, options);
  if (!store.ok()) return store.status();
  Result<Pyramid> pyramid = kOpen(*store, options, context);
  if (!pyramid.ok()) return pyramid.status();
  return MakeChunkedSource(path, *std::move(pyramid), context);
}

}  // namespace slabstream
