// SheetOpacity: the opacity of a voxel in its sheet.
//
// A transfer function gives the opacity alpha of `opacity_distance` voxel lengths of material; between neighbouring sheets a ray travels
// D, so in its sheet a voxel has 1 - (1 - alpha)^(D / distance). An orthographic camera has one D. Under perspective D is that of the ray
// through the voxel, D0 * ratio with the central ray's D0; shading interpolates between tables for a few ratios.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "common/classification/classification_table.h"
#include "common/planning/frame_plan.h"
#include "worker/kernels/shade.h"

namespace slabstream {

class SheetOpacity {
 public:
  explicit SheetOpacity(const FrameSetup& setup);

  // Colours, opacities and light of the frame.
  ShadeTables Tables(const ClassificationTable& table) const;

  bool one_level() const { return levels_ == 1; }

  // Places of the ratios of a beam's voxels among the levels, in [0, levels - 1).
  class Beam {
   public:
    float LevelAt(std::int32_t u) const {
      const float along_u = slope_0_ + float(u) * slope_step_;
      return std::clamp(std::sqrt(rest_ + along_u * along_u) * scale_ - offset_, 0.0F, last_);
    }

   private:
    friend class SheetOpacity;
    float slope_0_ = 0,
          slope_step_ = 0;  // of the ray through voxel u, along u: physical lengths a physical length along the traversal axis
    float rest_ = 1;        // 1 + the square of its slope along v
    float scale_ = 0, offset_ = 0, last_ = 0;
  };
  Beam BeamAt(std::int32_t k, std::int32_t v) const;

 private:
  double Ratio(const Vec3& voxel) const;

  const FrameSetup& setup_;
  SliceAxes axes_;
  double central_distance_;  // D0, in physical units
  int levels_ = 1;
  double least_ratio_ = 1, levels_per_ratio_ = 0;
};

}  // namespace slabstream
