#include "worker/renderers/shear/turned_voxels.h"

#include "common/parallel/parallel.h"
#include "worker/renderers/brick_ranges.h"

namespace slabstream::shear {
namespace {

// Copies one brick.
template <class T>
void TurnBrick(const BrickView<T>& brick, const Box& box, TurnedVoxels& turned) {
  const std::ptrdiff_t strides[3] = {1, brick.y_stride, brick.z_stride};
  const auto [x, y, z] = turned.axes;
  const Index3 size = box.size();
  const std::ptrdiff_t along_x = strides[Number(x)], along_y = strides[Number(y)], along_z = strides[Number(z)];
  for (std::int32_t slice = 0; slice < size[z]; ++slice) {
    for (std::int32_t row = 0; row < size[y]; ++row) {
      const T* const from = brick.first + row * along_y + slice * along_z;
      T* const to = const_cast<T*>(turned.Beam<T>(box.begin[y] + row, box.begin[z] + slice)) + (box.begin[x] - turned.begin[0] + kBeamPad);
      for (std::int32_t i = 0; i < size[x]; ++i) to[i] = from[i * along_x];
    }
  }
}

}  // namespace

TurnedVoxels Turn(const VoxelBricks& voxels, const std::array<Axis, 3>& axes) {
  TurnedVoxels turned;
  turned.axes = axes;
  turned.type = voxels.type();
  for (std::size_t i = 0; i < 3; ++i) {
    turned.begin[i] = voxels.box().begin[axes[i]];
    turned.end[i] = voxels.box().end[axes[i]];
  }
  turned.beam = turned.end[0] - turned.begin[0] + 2 * kBeamPad;
  const std::int32_t rows = turned.end[1] - turned.begin[1], slices = turned.end[2] - turned.begin[2];
  turned.samples =
      MakeLargeArray<std::byte>(std::size_t(turned.beam) * std::size_t(rows) * std::size_t(slices) * BytesPerSample(turned.type));
  VisitScalarType(voxels.type(), [&]<class T>(const T*) {
    const BrickGrid& grid = voxels.grid();
    ForEachRowOfBricks(grid, [&](Index3 brick) {
      for (; brick.x < grid.first.x + grid.counts.x; ++brick.x) {
        const Box box = grid.BoxOf(brick);
        BrickView<T> view = voxels.View<T>(brick);
        view.first = view.Row(box.begin.y, box.begin.z);
        TurnBrick(view, box, turned);
      }
    });
    ParallelFor(0, slices, [&](std::int32_t slice) {
      for (std::int32_t row = 0; row < rows; ++row) {
        T* const beam = const_cast<T*>(turned.Beam<T>(turned.begin[1] + row, turned.begin[2] + slice));
        std::fill_n(beam, kBeamPad, beam[kBeamPad]);
        std::fill_n(beam + turned.beam - kBeamPad, kBeamPad, beam[turned.beam - kBeamPad - 1]);
      }
    });
  });
  return turned;
}

}  // namespace slabstream::shear
