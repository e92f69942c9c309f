// RayLayers: the layers of one piece of a padded box, and the tables by which the ray caster shows them. Neither copies nor owns. Samples
// are padded like those of the volume (PaddedVoxels), so that a voxel has the same index in all of them.
#pragma once

#include <cstddef>

#include "common/frame/layer_look.h"
#include "common/memory/aligned_buffer.h"
#include "common/volume/volume.h"
#include "worker/rays/ray_look.h"
#include "worker/renderers/raycast/ray_fields.h"

namespace slabstream {

// Tables of labels. Made once a frame.
struct LabelTables {
  // Four floats each, by number: straight colour, and
  //   tint     the factor of the material's opacity
  //   surface  the opacity of one step along a ray
  // -1, as of label 0: the volume's material is drawn as it is
  AlignedVector<float> entries;
  bool surface = false;
  float tint = 0;            // share of the label's colour; 0 with surfaces
  float last = 0;            // number of the last entry
  float steps_a_length = 1;  // samples in the length of material that opacities of the transfer function belong to
};

// `opacity_distance`: of the transfer function.
LabelTables MakeLabelTables(const LabelLook& look, double steps_per_voxel, double opacity_distance);

struct RayLayers {
  // Null: labels are not shown.
  const LabelTables* labels = nullptr;
  ScalarType label_type = ScalarType::kUint8;  // or kUint16
  const std::byte* label_samples = nullptr;
  // Null: no other field is shown.
  const RayFields* fields = nullptr;
};

}  // namespace slabstream
