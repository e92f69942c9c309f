// FieldMap: where the samples of a box lie among the voxels of another field of the frame, and which of them the field has.
#pragma once

#include <array>

#include "common/frame/frame_setup.h"
#include "worker/rays/view_rays.h"

namespace slabstream {

struct FieldMap {
  // p of the frame lies at offset + p.x * steps[0] + p.y * steps[1] + p.z * steps[2] among the field's voxels.
  std::array<Float3, 3> steps{};
  Float3 offset{};
  Float3 low{}, high{};     // the field shows at its positions p with low <= p < high on every axis
  bool everywhere = false;  // all samples of the box lie there
};

FieldMap MakeFieldMap(const LevelBox& at, const FrameSetup& setup, const FieldSetup& field);

}  // namespace slabstream
