// Which node of a Zarr hierarchy is the volume: an array or an OME-Zarr image.
#pragma once

#include <set>
#include <string>

#include "common/base/status.h"
#include "data/stores/store.h"
#include "data/zarr/zarr_node.h"

namespace slabstream::zarr {

// For messages: the store's name, and the path in it.
std::string NameOf(const Store& store, const std::string& path);

// The node that is being read. Its objects are added to `keys`. NotFound: there is none; errors of NodeReading. Waits.
Result<ZarrNode> NodeOf(const Store& store, NodeReading reading, std::set<std::string>& keys);

// The node that a volume is read from, and the objects that were read to find it.
struct FoundVolume {
  ZarrNode node;
  std::set<std::string> keys;
};

// The node at `path`. If it is a group, the only volume in it, or the first image that bioformats2raw wrote. InvalidArgument: there are
// several, which the message names, be they arrays of a group, wells of a plate, images of a well, or label images. Waits.
Result<FoundVolume> FindVolume(Store& store, std::string path);

}  // namespace slabstream::zarr
