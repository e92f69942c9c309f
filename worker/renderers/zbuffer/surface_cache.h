// SurfaceCache: the surfaces of a padded box's boxes. The Z-buffer keeps them between frames until the transfer function makes other voxels
// opaque, or labels are shown in another way.
#pragma once

#include <cstddef>

#include "worker/renderers/box_data.h"
#include "worker/renderers/recent_boxes.h"
#include "worker/renderers/zbuffer/surface.h"

namespace slabstream {

class SurfaceCache : public BoxCache {
 public:
  // Faces of the opaque voxels of `box`, which lies in the padded box. Valid until the next call.
  // ResourceExhausted: of LabelsOfBox.
  Result<const Surface*> Of(BoxData& data, const FrameSetup& setup, const Box& box);
  // The bins of the voxels that were opaque at the last call; valid until the next one.
  const BinSelection& opaque_bins() const { return opaque_bins_; }
  const BoxLabels* labels() const { return labels_.shown(); }  // likewise; null: they are not shown

  std::size_t bytes() const override;

 private:
  BinSelection opaque_bins_;
  LabelsOfBox labels_;
  RecentBoxes<Surface> surfaces_;
};

}  // namespace slabstream
