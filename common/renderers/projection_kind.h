// ProjectionKind: the planning half of renderers that project values: the samples along each pixel's ray become one value (ProjectTile,
// worker/rays/project.h), and values become colours at the end. Every box draws, since any may change a ray's value.
#pragma once

#include "common/image/local_image.h"
#include "common/image/resolve.h"
#include "common/parallel/parallel.h"
#include "common/renderers/renderer_kind.h"

namespace slabstream {

class ProjectionKind : public RendererKind {
 public:
  using RendererKind::RendererKind;

  // The first parameter is the sampling rate. The time of a box is that of its samples, along the rays of all pixels that it covers.
  AnalyticCost MakeCost(const CostBasis& basis) const override;
  ClassificationTable DrawnTable(const TransferFunction& transfer, const VolumeSummary& summary) const override;
  bool FinishCopies(const FrameSetup& /*setup*/) const override { return false; }

 protected:
  // The picture of a frame. color(pixel, rgba): premultiplied RGBA of a pixel of the frame; `rgba` is 0 before.
  template <class Color>
  static LocalImage ColorPixels(const LocalImage& frame, const FrameSetup& setup, Color&& color) {
    LocalImage picture = MakeLocalImage(PixelFormat::kRgba, frame.bounds);
    constexpr std::size_t kGrain = 4096;  // pixels
    ParallelForRanges(0, frame.rgba.size() / 4, kGrain, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) color(&frame.rgba[4 * i], &picture.rgba[4 * i]);
    });
    return Resolve(picture, setup.camera.supersample);
  }
};

// The sum of values in [0, 1] that a pixel of format kSum holds. Its channels are sums over all samples: of the bytes
// of min(floor(value * 2^24), 2^24 - 1), highest first, and the number of samples. Exact up to 65793 samples of a ray.
inline double SumOfValues(const float* pixel) {
  return double(pixel[0]) * 0x1p-8 + double(pixel[1]) * 0x1p-16 + double(pixel[2]) * 0x1p-24;
}

}  // namespace slabstream
