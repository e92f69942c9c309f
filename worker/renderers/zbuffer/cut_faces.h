// CutFaces: clipping in the Z-buffer. A face of the surface is drawn where its depth is not clipped. Where a ray comes out of what is
// clipped away inside an opaque voxel, the cut through the voxel is seen: a flat face in the plane of the clip region's side.
//
// Cuts go into the keys of a band like faces, so that they hide what lies behind them, and bricks there are not drawn. Before the band is
// shaded, they are taken out again (TakeSeen) and lit by the plane of their side (Shade).
//
// A face in the plane of a cut lies within kSlack of it and is not drawn: the cut stands for it.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "common/frame/frame_setup.h"
#include "common/image/local_image.h"
#include "common/view/phong.h"
#include "worker/kernels/draw_faces.h"
#include "worker/kernels/shade_faces.h"
#include "worker/renderers/bin_lookup.h"
#include "worker/renderers/box_data.h"
#include "worker/renderers/zbuffer/box_labels.h"
#include "worker/renderers/zbuffer/clip_rays.h"

namespace slabstream {

// One pixel of a cut.
struct CutPixel {
  std::int32_t x = 0, y = 0;
  float depth = 0;
  std::uint32_t voxel = 0;  // FaceIndex
  std::uint32_t label = 0;
  std::uint16_t bin = 0;
  std::uint16_t side = 0;  // the side of the clip region
};

class CutFaces {
 public:
  // `box`: no other voxels are drawn. `opaque`: the bins of opaque voxels, by the padded box's table. `labels`: null if they are not shown.
  // All must outlive this. The setup's clip region is not empty.
  CutFaces(BoxData& data, const FrameSetup& setup, const Box& box, const BinSelection& opaque, const BoxLabels* labels);

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
  // Puts those cuts through voxels of the box into the band that nothing in it hides yet. Their face numbers are kFirstCut + their place in
  // `cuts`.
  static constexpr std::uint32_t kFirstCut = 0x80000000;  // surfaces have fewer faces
  void Draw(const KeyBand& band, std::vector<CutPixel>& cuts) const;
  // Takes the cuts out of the band again, and leaves those in `cuts` that are seen.
  static void TakeSeen(const KeyBand& band, std::vector<CutPixel>& cuts);
  // Fills in pixels of `image` (kDepth), after the others. Takes the colours of `shading`.
  void Shade(const std::vector<CutPixel>& cuts, const FaceShading& shading, LocalImage& image) const;

 private:
  PhongFactors LightOn(const CutPixel& cut) const;
  void DrawRow(const KeyBand& band, std::int32_t y, ClipRays::Columns columns, std::vector<CutPixel>& cuts) const;

  const ClipRegion& region_;
  const ClipRays rays_;
  const VoxelBlock& voxels_;
  const Box box_;
  const bool keep_;
  const double slack_;                               // physical
  const double margin_;                              // physical: what is so far from every side needs no limits
  const float least_depth_;                          // the least depth of a cut; kNeverMet: there is none
  std::array<LinearInImage, 3> origin_, direction_;  // a pixel's ray in data space: origin + depth * direction
  std::vector<PhongFactors> light_;                  // by side
  std::vector<PhongFactors> of_each_light_;          // with a FrameLight: [side][light], without the ambient light
  float ambient_ = 0;
  const ClassificationTable& table_;
  const BinSelection& opaque_;
  const BoxLabels* const labels_;
  const FrameLight* const frame_light_;
  const Index3 bricks_;
};

}  // namespace slabstream
