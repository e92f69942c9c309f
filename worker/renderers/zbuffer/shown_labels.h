// ShownLabels: what labels (common/frame/layer_look.h) mean to the Z-buffer, which draws opaque voxels and no others. Half decides, as it
// does of the transfer function's opacities: a label whose opacity is below 1/2 is clear.
#pragma once

#include <cstdint>
#include <vector>

#include "common/frame/layer_look.h"
#include "common/volume/bricks.h"

namespace slabstream {

enum class LabelUse : std::uint8_t {
  kAsVolume,  // the transfer function says whether voxels are opaque
  kClear,     // they are not
  kOpaque,    // they are
};

struct ShownLabels {
  const BrickedVoxels* numbers = nullptr;  // uint8 or uint16
  std::vector<LabelUse> uses;              // by number, not empty

  // The number of a voxel of the slab. Numbers without an entry are a peer's mistake and count as the last one.
  std::uint16_t NumberOf(const Index3& voxel) const;
  LabelUse UseOf(const Index3& voxel) const { return uses[NumberOf(voxel)]; }
  // False if no label in [low, high] is opaque. low > high: there is none.
  bool AnyOpaqueBetween(float low, float high) const;
};

// By number; label 0 is none.
std::vector<LabelUse> UsesOf(const LabelLook& look);

// [number][4], for FaceShading::label_colors.
std::vector<float> LabelColors(const LabelLook& look);

}  // namespace slabstream
