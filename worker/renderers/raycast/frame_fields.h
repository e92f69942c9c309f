// FrameFields: what the ray caster needs of the other fields of a frame. Made once a frame.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "common/base/status.h"
#include "common/frame/frame_setup.h"
#include "worker/rays/ray_volume.h"
#include "worker/renderers/raycast/ray_fields.h"

namespace slabstream {

class FrameFields {
 public:
  // `data`: of the box `at`. ResourceExhausted: kernels cannot address the voxels that a field has there. Parallel.
  static Result<FrameFields> Make(const BoxData& data, const LevelBox& at, const FrameSetup& setup, double samples_per_voxel);

  bool empty() const { return fields_.empty(); }

  // RayFields::fields, as samples of a piece read them. `volume`: the volume's look.
  std::vector<RayField> Of(const RayPiece& piece, const RayLook& volume) const;

  // Which fields may show in each cell of a piece, as RayFields::shown without the volume. Parallel.
  std::vector<std::uint16_t> ShownIn(const RayPiece& piece) const;

  // What ShownIn depends on, beside the piece. Equal ones say the same; they do not keep voxels.
  class Visible {
   public:
    friend bool operator==(const Visible& a, const Visible& b);

   private:
    friend class FrameFields;
    struct Field {
      VisibleSamples samples;
      std::weak_ptr<std::byte[]> voxels;
      AffineMap map;
    };
    std::vector<Field> fields_;
  };
  Visible visible() const;

 private:
  struct Field {
    const RayPiece* piece = nullptr;
    AffineMap from_level;  // to the field's voxels from those of the box's level
    RayLook look;
    RayField at;  // of any piece
  };
  std::vector<Field> fields_;  // those that reach there and have a weight
};

}  // namespace slabstream
