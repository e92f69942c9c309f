// TurnedBox: a box of a volume whose voxels are turned as they are read, and where its samples belong.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "common/volume/box.h"
#include "data/sources/volume_source.h"
#include "data/volume_io/sample_type.h"
#include "data/volume_io/world_placement.h"

namespace slabstream {

struct TurnedBox {
  AxisTurn turn;
  Index3 size;  // the size of the volume
  Box box;
  BoxRoom out;  // for samples as CopySamples writes them

  Box Stored() const;                 // the box by the axes of the file
  Box Turned(const Box& part) const;  // a part of that, by those of the volume
  // Where the samples of a part belong, which is given by the axes of the volume.
  BoxRoom Place(const Box& turned_part, SampleType type) const;
  // Fills in a part, given by the axes of the file, from its samples there: `steps` are samples from one to the next along those axes.
  void Fill(const Box& part, SampleType type, const std::byte* from, const std::array<std::int64_t, 3>& steps) const;
};

}  // namespace slabstream
