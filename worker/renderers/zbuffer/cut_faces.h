// CutFaces: clipping in the Z-buffer. A face of the surface is drawn where its depth is not clipped. Where a ray comes out of what is
// clipped away inside an opaque voxel, the cut through the voxel is seen: a flat face in the plane of the clip region's side.
//
// Cuts go into the keys of a band like faces, so that they hide what lies behind them, and bricks there are not drawn. Instead of a face's
// number, a cut's key holds kCut, its bin and its label. Before a row is shaded, its cuts are taken out (TakeSeen); after it, they are lit
// by the plane of their side (Shade).
//
// A face in the plane of a cut lies within kSlack of it and is not drawn: the cut stands for it.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "common/base/aligned_buffer.h"
#include "common/frame/frame_setup.h"
#include "common/image/local_image.h"
#include "common/view/phong.h"
#include "worker/kernels/draw_faces.h"
#include "worker/kernels/shade_faces.h"
#include "worker/renderers/bin_lookup.h"
#include "worker/renderers/slab_data.h"
#include "worker/renderers/zbuffer/clip_rays.h"
#include "worker/renderers/zbuffer/shown_labels.h"

namespace slabstream {

// The cuts that are seen in a row of a band, by column from `begin` on.
struct SeenCuts {
  std::int32_t begin = 0, end = 0;
  AlignedVector<float> depth;        // 0: no cut is seen; kRowPadding elements more
  std::vector<std::uint32_t> looks;  // where one is: bin << 16 | label
};

class CutFaces {
 public:
  // `box`: no other voxels are drawn. `opaque`: the bins of opaque voxels, by the slab's table. `labels`: null if they are not shown. All
  // must outlive this. The setup's clip region is not empty.
  CutFaces(SlabData& slab, const FrameSetup& setup, const Box& box, const BinSelection& opaque, const ShownLabels* labels);

  // Pixels outside see nothing of the box that lies in the clip region.
  const PixelBounds& bounds() const { return rays_.bounds(); }
  // True: all faces of the voxels of `part` are drawn; they need no limits.
  bool IsWhole(const Box& part) const;

  // Whether depths from ... to are drawn (DepthLimits::inside).
  bool inside() const { return keep_; }
  // Limits of `pixels`, which lie in the band; placed as its keys are.
  void Limits(const PixelBounds& pixels, const KeyBand& band, float* from, float* to) const;

  // Bricks nearer than this are best drawn before the cuts, others after them.
  float turn() const { return keep_ ? 0 : least_depth_; }
  // Puts those cuts through voxels of the box into the band that nothing in it hides yet.
  void Draw(const KeyBand& band) const;
  // Takes the cuts out of a row of the band.
  void TakeSeen(const KeyBand& band, std::int32_t y, SeenCuts& seen) const;
  // Fills in the row's pixels of `image` (kDepth) where cuts are seen. Of `shading`: the colours.
  void Shade(const SeenCuts& seen, std::int32_t y, const FaceShading& shading, LocalImage& image) const;

 private:
  RayRow RaysOf(std::int32_t y) const;
  void DrawRow(const KeyBand& band, std::int32_t y, ClipRays::Columns columns) const;
  // The low half of the key of a cut through the voxel; kNoCut: it is not opaque.
  template <class T, class VoxelAt>
  std::uint32_t LookOf(T sample, VoxelAt&& voxel_at) const;

  const ClipRegion& region_;
  const ClipRays rays_;
  const VoxelBlock& voxels_;
  const Box box_;
  const bool keep_;
  const double slack_;                               // physical
  const double margin_;                              // likewise: what is so far from every side needs no limits
  const float least_depth_;                          // of a cut; kNeverMet: there is none
  std::array<LinearInImage, 3> origin_, direction_;  // of a pixel's ray, data space: origin + depth * direction
  std::vector<PhongFactors> light_;                  // by side
  const ClassificationTable& table_;
  const BinSelection& opaque_;
  const ShownLabels* const labels_;
  const Index3 bricks_;
};

}  // namespace slabstream
