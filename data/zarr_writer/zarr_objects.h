// The objects that hold the elements of an image's levels: chunks as files of their own (Zarr v2), or shards of chunks with an index behind
// them (Zarr v3). A writer deals in regions of the size of ZarrLayout::shard: one shard, or the chunks in its place.
//
// Each file is written whole or not at all, so one that is there is finished. Chunks of zeros alone are left out of shards.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "common/base/status.h"
#include "common/volume/box.h"
#include "data/zarr_writer/level_plan.h"
#include "data/zarr_writer/ome_metadata.h"

namespace slabstream {

struct ZarrRegion {
  int level = 0;
  Index3 index;  // the region's place, from 0 along each axis
};

class ZarrObjects {
 public:
  ZarrObjects(std::string folder, const ZarrLayout& layout, std::vector<WrittenLevel> levels);

  const ZarrLayout& layout() const { return layout_; }
  const std::vector<WrittenLevel>& levels() const { return levels_; }
  Index3 RegionsOf(int level) const;                      // along each axis
  Box BoxOf(const ZarrRegion& region) const;              // voxels
  std::uint64_t BytesOf(const ZarrRegion& region) const;  // bytes of their elements

  bool IsFinished(const ZarrRegion& region) const;
  // `elements`: of the region's box, x fastest. On all cores; the same bytes whatever their number. Unavailable: cannot be written.
  Status Write(const ZarrRegion& region, const std::byte* elements) const;
  // What Write wrote. Unavailable, DataLoss: cannot be read, is damaged; names the file.
  Status Read(const ZarrRegion& region, std::byte* elements) const;

  // Bytes that Write takes beside `elements`.
  std::uint64_t memory() const;

 private:
  Index3 ChunksOf(const ZarrRegion& region) const;  // in the region, along each axis
  std::string FileOf(int level, const Index3& object) const;
  Status WriteShard(const ZarrRegion& region, const std::byte* elements) const;
  Status WriteChunks(const ZarrRegion& region, const std::byte* elements) const;
  Status ReadShard(const ZarrRegion& region, std::byte* elements) const;
  Status ReadChunks(const ZarrRegion& region, std::byte* elements) const;

  const std::string folder_;
  const ZarrLayout layout_;
  const std::vector<WrittenLevel> levels_;
};

}  // namespace slabstream
