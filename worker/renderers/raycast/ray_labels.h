// RayLabels: the labels of one box, and the tables by which the ray caster shows them at the samples of a piece of the volume. Neither
// copies nor owns.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "common/base/status.h"
#include "common/frame/frame_setup.h"
#include "common/memory/aligned_buffer.h"
#include "common/volume/affine_map.h"
#include "worker/rays/label_volume.h"
#include "worker/rays/ray_box.h"

namespace slabstream {

// Tables of labels. Made once a frame.
struct LabelTables {
  // Four floats each, by number: straight colour, and
  //   tint     the factor of the material's opacity
  //   surface  the opacity of one step along a ray
  // -1, as of label 0: the volume's material is drawn as it is
  AlignedVector<float> entries;
  bool surface = false;
  bool smooth = false;       // LabelLook::smooth
  float tint = 0;            // share of the label's colour; 0 with surfaces
  float steps_a_length = 1;  // samples in the length of material that opacities of the transfer function belong to
};

// `opacity_distance`: of the transfer function.
LabelTables MakeLabelTables(const LabelLook& look, const std::vector<LabelStyle>& styles, double steps_per_voxel, double opacity_distance);

struct RayLabels {
  LabelTables tables;
  RayBox voxels;         // numbers, strides and origin; its positions do not matter
  Float3 low{}, high{};  // the labels reach positions p of theirs with low <= p < high on every axis
  // p among the volume's voxels lies at offset + p.x * steps[0] + p.y * steps[1] + p.z * steps[2] among those of the labels.
  std::array<Float3, 3> steps{};
  Float3 offset{};
  // What is material in which cell is found from here:
  AffineMap map;  // the same map
  const RayPiece* numbers = nullptr;
  MatterNumbers matter;
};

// The labels that a frame shows of a padded box. nullopt: none is shown, or they do not reach there. ResourceExhausted: kernels cannot
// address their voxels. Parallel.
Result<std::optional<RayLabels>> LabelsFor(const BoxData& data, const LevelBox& at, const FrameSetup& setup, double steps_per_voxel);

}  // namespace slabstream
