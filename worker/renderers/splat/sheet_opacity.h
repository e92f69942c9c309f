// SheetOpacity: the opacity of a voxel in its sheet.
//
// A transfer function gives the opacity alpha of `opacity_distance` voxel lengths of material. Between neighbouring sheets a ray travels D,
// so in its sheet a voxel has opacity 1 - (1 - alpha)^(D / distance). An orthographic camera has one D. Under perspective D depends on the
// ray through the voxel: D0 * ratio, with D0 that of the central ray; shading interpolates between tables for a few ratios.
#pragma once

#include <cstdint>

#include "common/classification/classification_table.h"
#include "common/frame/frame_setup.h"
#include "worker/kernels/shade.h"

namespace slabstream {

class SheetOpacity {
 public:
  explicit SheetOpacity(const FrameSetup& setup);

  // Colours, opacities and light of the frame.
  ShadeTables Tables(const ClassificationTable& table) const;

  bool one_level() const { return levels_ == 1; }

  // Slopes of the rays through the voxels of slice k: distance along u and v per distance along the traversal axis. One level: none.
  struct Slopes {
    float u_0 = 0, u_step = 0, v_0 = 0, v_step = 0;  // at voxel 0, and from voxel to voxel

    float AlongU(std::int32_t u) const { return u_0 + float(u) * u_step; }
    float AlongV(std::int32_t v) const { return v_0 + float(v) * v_step; }
  };
  Slopes SlopesIn(std::int32_t k) const;

 private:
  double Ratio(const Vec3& voxel) const;

  const FrameSetup& setup_;
  SliceAxes axes_;
  double central_distance_;  // D0, in physical units
  int levels_ = 1;
  double least_ratio_ = 1, levels_per_ratio_ = 0;
};

}  // namespace slabstream
