#include "data/survey/pieces.h"

#include <future>
#include <memory>
#include <utility>

#include "common/volume/box_assembly.h"

namespace slabstream {
namespace {

// Voxels along each axis of pieces: whole blocks of the source and whole bricks as far as that fits into kPieceBytes, then more of them
// along x, y and z.
Index3 PieceSize(const SourceLevel& level) {
  const Index3& size = level.description.geometry.size;
  const auto bytes = [&](const Index3& piece) {
    return std::int64_t(CountIn(piece)) * std::int64_t(BytesPerSample(level.description.type));
  };
  Index3 piece;
  for (const Axis axis : kAxes)
    piece[axis] = std::min((level.block[axis] + kBrick - 1) / kBrick * kBrick, CubesOver(size, kBrick)[axis] * kBrick);
  for (const Axis axis : {Axis::kZ, Axis::kY, Axis::kX}) {
    while (bytes(piece) > 2 * kPieceBytes && piece[axis] > kBrick) piece[axis] = (piece[axis] / kBrick + 1) / 2 * kBrick;
  }
  for (const Axis axis : kAxes) {
    while (2 * bytes(piece) <= kPieceBytes && piece[axis] < size[axis]) piece[axis] *= 2;
  }
  return piece;
}

struct Piece {
  VoxelBlock block;
  std::promise<Status> end;
};

}  // namespace

std::vector<Box> PiecesOf(const SourceLevel& level) { return CutAtBlocks(level.description.geometry.bounds(), PieceSize(level)); }

Status ReadPieces(VolumeSource& source, int level, const std::vector<Box>& boxes, std::size_t ahead,
                  const std::function<void(const VoxelBlock&)>& take, const std::stop_token& stop) {
  const ScalarType type = source.info().levels[std::size_t(level)].description.type;
  std::vector<std::unique_ptr<Piece>> under_way(boxes.size());
  std::size_t begun = 0;
  Status first_error;
  for (std::size_t i = 0; i < boxes.size(); ++i) {
    for (; begun < boxes.size() && begun <= i + ahead && first_error.ok() && !stop.stop_requested(); ++begun) {
      under_way[begun] = std::make_unique<Piece>(Piece{MakeVoxelBlock(boxes[begun], type), {}});
      Piece& piece = *under_way[begun];
      source.Read(level, boxes[begun], piece.block.bytes, stop, [&piece](Status status) { piece.end.set_value(std::move(status)); });
    }
    if (under_way[i] == nullptr) break;
    const Status status = under_way[i]->end.get_future().get();
    if (status.ok() && first_error.ok()) take(under_way[i]->block);
    if (first_error.ok()) first_error = status;
    under_way[i].reset();
  }
  if (first_error.ok() && begun < boxes.size()) return Status::Cancelled("reading was stopped");
  return first_error;
}

}  // namespace slabstream
