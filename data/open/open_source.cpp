#include "data/open/open_source.h"

#include <algorithm>
#include <filesystem>

#include "common/base/url.h"
#include "data/hdf5/hdf5_format.h"
#include "data/metadata/open_store_for.h"
#include "data/n5/n5.h"
#include "data/open/remote_source.h"
#include "data/open/unchanged_source.h"
#include "data/positional/positional_source.h"
#include "data/precomputed/precomputed.h"
#include "data/tiles/tiled_tiff.h"
#include "data/zarr/zarr.h"

namespace slabstream {

const std::vector<SourceFormat>& SourceFormats() {
  static const std::vector<SourceFormat> kFormats = {Hdf5(), N5(), Precomputed(), Zarr(), TiledTiff(), UncompressedFile()};
  return kFormats;
}

const SourceFormat* FindSourceFormat(const std::string& path, const ReadOptions& options) {
  const auto found = std::ranges::find_if(SourceFormats(), [&](const SourceFormat& format) { return format.recognises(path, options); });
  return found == SourceFormats().end() ? nullptr : &*found;
}

bool IsReadInParts(const std::string& path, const ReadOptions& options) {
  return IsUrl(path) || FindSourceFormat(path, options) != nullptr;
}

Result<std::shared_ptr<VolumeSource>> OpenSource(const std::string& path, const ReadOptions& options, const SourceContext& context) {
  const bool remote = IsUrl(path);
  std::error_code error;
  if (!remote && !std::filesystem::exists(path, error)) return Status::NotFound(path + ": does not exist");
  ReadOptions with_store = options;
  RemoteFormat there{.format = remote ? nullptr : FindSourceFormat(path, options)};
  if (remote) {
    Result<std::shared_ptr<Store>> store = OpenStoreFor(path, options);
    if (!store.ok()) return store.status();
    with_store.store = *std::move(store);
    const Result<RemoteFormat> found = FindRemoteFormat(*with_store.store, SourceFormats());
    if (!found.ok()) return found.status();
    there = *found;
  }
  const SourceFormat* const format = there.format;
  if (format == nullptr) return Status::InvalidArgument(path + ": is no volume that can be read in parts");
  for (const ReadOption& option : ReadOptionList()) {
    const bool taken = option.of_addresses ? remote : std::ranges::find(format->options, option.name) != format->options.end();
    if (option.given(options) && !taken) {
      return Status::InvalidArgument(path + ": " + std::string(format->name) + " takes no option " + std::string(option.name));
    }
  }
  const auto open = [&] { return format->open(path, with_store, context); };
  return remote ? OpenRemote(there.version, options.query, open) : OpenUnchanged(path, open);
}

}  // namespace slabstream
