// Who owns a sample: pixel P of slice k belongs to the box whose cross-section holds the point where P's ray meets the plane of the slice.
// The planes that divide a volume are seen in a slice as lines of the image; each row of pixels is cut by a line at one column.
//
// The cut is one function of (camera, plane, slice, row), so the boxes on both sides of a plane find the same column bit for bit, and every
// sample has one owner. Boxes on the volume's rim own everything outside.
#pragma once

#include <limits>
#include <vector>

#include "common/image/local_image.h"
#include "worker/render/splatting/slice_projection.h"

namespace slabstream {

// Half-open columns of the frame.
struct ColumnInterval {
  std::int32_t begin = 0, end = 0;
  friend bool operator==(const ColumnInterval&, const ColumnInterval&) = default;
};

class Ownership {
 public:
  // For samples of `box` within a volume; `projection` must outlive this.
  Ownership(const SliceProjection& projection, const Box& box, const VolumeGeometry& geometry);

  // True if the box spans the volume in both in-slice axes: it owns every sample of its slices.
  bool owns_all() const { return planes_.empty(); }

  void SetSlice(std::int32_t k);

  // Columns of a row of the frame that the box owns in the slice; may be empty. Limits lie within +-2^30.
  ColumnInterval Row(std::int32_t row) const;

  // False only if no pixel of the rectangle is owned in the slice.
  bool MayOwn(const PixelBounds& pixels) const;

 private:
  // A plane u = position - 0.5 (or v), of which the box has one side.
  struct Plane {
    Axis axis;
    std::int32_t position;  // first index of the upper side
    bool own_upper;
    // In the slice: the point (x, y) of the image lies on the upper side where x * by_x + y * by_y + constant >= 0.
    double by_x = 0, by_y = 0, constant = 0;
  };

  const SliceProjection& projection_;
  std::vector<Plane> planes_;
};

}  // namespace slabstream
