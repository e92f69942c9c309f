// ShownLabels: which label the voxels of a padded box have, and what it means to the Z-buffer (common/frame/label_use.h).
#pragma once

#include <cstdint>
#include <vector>

#include "common/frame/label_use.h"
#include "common/volume/bricks.h"

namespace slabstream {

struct ShownLabels {
  const BrickedVoxels* numbers = nullptr;  // uint8 or uint16
  std::vector<LabelUse> uses;              // by number, not empty

  // The number of a voxel of the padded box. Numbers without an entry are a peer's mistake and count as the last one.
  std::uint16_t NumberOf(const Index3& voxel) const;
  LabelUse UseOf(const Index3& voxel) const { return uses[NumberOf(voxel)]; }
  // False if no label in [low, high] is opaque. low > high: there is none.
  bool AnyOpaqueBetween(float low, float high) const;
};

// [number][4], for FaceShading::label_colors.
std::vector<float> LabelColors(const LabelLook& look);

}  // namespace slabstream
