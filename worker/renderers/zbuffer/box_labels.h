// BoxLabels: which label the voxels of a padded box of the volume have, and what it means to the Z-buffer (LabelUse). A voxel has the
// label of the nearest voxel of the field of labels.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "common/frame/label_look.h"
#include "worker/rays/label_volume.h"
#include "worker/renderers/brick_ranges.h"

namespace slabstream {

struct BoxLabels {
  VoxelBlock numbers;          // uint32, of the padded box
  BrickRanges ranges;          // of the numbers
  std::vector<LabelUse> uses;  // by number
  std::vector<float> colors;   // [number][4], for FaceShading::label_colors

  std::uint32_t NumberOf(const Index3& voxel) const { return numbers.samples<std::uint32_t>()[numbers.Offset(voxel)]; }
  LabelUse UseOf(const Index3& voxel) const { return uses[NumberOf(voxel)]; }
  // False if no label in [low, high] is opaque. low > high: there is none.
  bool AnyOpaqueBetween(float low, float high) const;
};

// Keeps them between frames.
class LabelsOfBox {
 public:
  // Those of the padded box of `data`, which `box` lies in, at level 0. Null: none are shown, or they do not reach there. `changed`: other
  // voxels are opaque than at the call before. ResourceExhausted: of LabelVolume. Parallel.
  Result<const BoxLabels*> Of(const BoxData& data, const FrameSetup& setup, bool& changed);
  const BoxLabels* shown() const { return shown_ ? &*shown_ : nullptr; }  // of the last call

  std::size_t bytes() const;

 private:
  std::optional<BoxLabels> shown_;
  std::weak_ptr<std::byte[]> found_from_;  // the numbers of the field of labels, of shown_
};

}  // namespace slabstream
