// RayFields: the fields that a frame of several fields shows, as the ray caster's kernel reads them at the samples of one piece of a padded
// box. Neither copies nor owns.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "common/volume/field_info.h"
#include "worker/rays/field_map.h"
#include "worker/rays/ray_box.h"
#include "worker/rays/ray_look.h"

namespace slabstream {

struct RayField {
  RayBox voxels;                  // samples, strides and cells; its positions do not matter
  const RayLook* look = nullptr;  // lights and spacing along the field's axes. Opacities are those of one step with the field's weight
  FieldMap map;
  // A normal n of a plane among the volume's voxels is n.x * normals[0] + n.y * normals[1] + n.z * normals[2] among the field's.
  std::array<Float3, 3> normals{};
  bool on_same_grid = false;  // a sample's floor among the field's voxels is that among the volume's plus `shift`
  Index3 shift{};
  bool over = false;         // it covers the fields before it; else it adds to them
  float steps_a_length = 1;  // samples in the length of material by whose opacity it covers
};

struct RayFields {
  static constexpr std::int32_t kVolume = 1;  // in `shown`; field i has the bit kVolume << i

  std::span<const RayField> fields;      // in the order in which they are blended; the first is the volume
  const std::uint16_t* shown = nullptr;  // by cell of the piece: what may show there. Kernels may read two bytes more
  bool flat = false;                     // FrameSetup::flat
};

}  // namespace slabstream
