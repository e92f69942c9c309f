// SurfaceCache: the surfaces of a padded box's boxes. The Z-buffer keeps them between frames until the transfer function makes other voxels
// opaque, or labels are shown in another way.
#pragma once

#include <cstddef>

#include <optional>

#include "worker/renderers/box_data.h"
#include "worker/renderers/recent_boxes.h"
#include "worker/renderers/zbuffer/surface.h"

namespace slabstream {

class SurfaceCache : public BoxCache {
 public:
  // Faces of the opaque voxels of `box`, which lies in the padded box. Valid until the next call.
  const Surface& Of(BoxData& data, const FrameSetup& setup, const Box& box);
  // The bins of the voxels that were opaque at the last call; valid until the next one.
  const BinSelection& opaque_bins() const { return opaque_bins_; }
  const ShownLabels* labels() const { return labels_ ? &*labels_ : nullptr; }  // null: they are not shown

  std::size_t bytes() const override;

 private:
  void ShowLabels(const BoxData& data, const LayerLooks& looks);

  BinSelection opaque_bins_;
  std::optional<ShownLabels> labels_;
  std::optional<BrickRanges> label_ranges_;  // once labels were shown
  RecentBoxes<Surface> surfaces_;
};

}  // namespace slabstream
