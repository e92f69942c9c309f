// UnreadParts: what need not be read of a stored level, because an index of its bricks (VolumeSummary::indexed) tells that it shows
// nothing.
//
// A sample reads voxels within the renderer's reach, and shows nothing without a drawn voxel within its reach. So no sample that shows
// anything reads a voxel that is twice the reach away from all drawn ones: such voxels may have any sample that is not drawn either.
#pragma once

#include <cstdint>
#include <vector>

#include "common/classification/classification_table.h"
#include "common/volume/filled_box.h"
#include "common/volume/summary.h"

namespace slabstream {

class UnreadParts {
 public:
  // summary.indexed is not null, summary.stored has a value; `summary` must outlive this. `drawn`: RendererKind::DrawnTable; `reach`: of
  // the renderer, in voxels; `layers`: OtherBricks (other_bricks.h).
  UnreadParts(const VolumeSummary& summary, ClassificationTable drawn, std::int32_t reach, const std::vector<std::uint8_t>& layers);

  // Whether a sample that `box` owns may show something. The box is not empty, and inside the volume.
  bool Shows(const Box& box) const { return AnyDrawn(Grown(box, reach_, bounds_)); }

  // The parts of a padded box that need not be read: blocks of the source, several of them together if they are small. At most kMaxFilled.
  std::vector<FilledBox> Of(const Box& padded) const;

 private:
  bool AnyDrawn(const Box& box) const;
  void AddFill(const Box& part, std::vector<FilledBox>& filled) const;

  const VolumeSummary& summary_;
  const Box bounds_;
  const std::int32_t reach_;
  const Index3 blocks_;              // voxels of what is read or left out together
  std::vector<std::uint8_t> drawn_;  // by brick: 1: a voxel of it may be drawn
};

}  // namespace slabstream
