// Zarr, versions 2 and 3, in folders and zip archives: OME-Zarr images with their levels, and plain arrays.
//
//   scan.ome.zarr      scan.ome.zarr/labels/cells      scan.ozx?array=labels/cells      simulation.zarr?array=density,time=3
#include <algorithm>
#include <filesystem>

#include "data/metadata/open_store_for.h"
#include "data/volume_io/formats.h"
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

}  // namespace
}  // namespace zarr

VolumeFormat Zarr() {
  return {.name = "Zarr",
          .recognises = zarr::Recognises,
          .options = {"time", "channel", "spacing", "array", "follow-links"},
          .markers = {zarr::kNodeObjects.begin(), zarr::kNodeObjects.end()},
          .open = OpenInStore<zarr::OpenPyramid>};
}

}  // namespace slabstream
