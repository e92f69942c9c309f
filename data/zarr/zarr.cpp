#include "data/zarr/zarr.h"

#include <algorithm>
#include <filesystem>
#include <utility>

#include "data/metadata/open_store_for.h"
#include "data/sources/chunked_source.h"
#include "data/zarr/zarr_node.h"
#include "data/zarr/zarr_pyramid.h"

namespace slabstream {
namespace zarr {
namespace {

bool IsArchive(const std::string& path) { return path.ends_with(".zip") || path.ends_with(".ozx"); }

bool Recognises(const std::string& path, const ReadOptions&) {
  std::error_code error;
  const auto is_there = [&](std::string_view name) { return std::filesystem::is_regular_file(std::filesystem::path(path) / name, error); };
  if (std::filesystem::is_directory(path, error)) return std::ranges::any_of(kNodeObjects, is_there);
  if (!IsArchive(path)) return false;
  const Result<std::shared_ptr<Store>> archive = ZipStore(path);
  const Result<std::vector<std::string>> names = archive.ok() ? (*archive)->List("") : archive.status();
  const auto has = [&](std::string_view name) { return std::ranges::find(*names, name) != names->end(); };
  return names.ok() && std::ranges::any_of(kNodeObjects, has);
}

Result<std::shared_ptr<VolumeSource>> Open(const std::string& path, const ReadOptions& options, const SourceContext& context) {
  const Result<std::shared_ptr<Store>> store = OpenStoreFor(path, options);
  if (!store.ok()) return store.status();
  Result<Pyramid> pyramid = OpenPyramid(*store, options, context);
  if (!pyramid.ok()) return pyramid.status();
  return MakeChunkedSource(path, *std::move(pyramid), context);
}

}  // namespace
}  // namespace zarr

SourceFormat Zarr() {
  return {.name = "Zarr",
          .recognises = zarr::Recognises,
          .options = {"time", "channel", "spacing", "array", "follow-links"},
          .markers = {zarr::kNodeObjects.begin(), zarr::kNodeObjects.end()},
          .open = zarr::Open};
}

}  // namespace slabstream
