// Blocks of images as pieces of one: files of .vtm and its like.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "data/volume_io/structured_grid.h"
#include "data/volume_io/vtk_image.h"
#include "data/volume_io/vtk_list.h"

namespace slabstream {
namespace {

// Where the first voxel of a block lies on the lattice of another one. InvalidArgument: the block has another lattice.
Result<Index3> PlaceOnLattice(const RawHeader& lattice, const RawHeader& block) {
  const auto wrong = [](Axis axis, const std::string& why) {
    return Status::InvalidArgument(fmt::format("along {} {}, as those of the first block", Letter(axis), why));
  };
  Index3 place;
  for (const Axis axis : kAxes) {
    const auto i = std::size_t(Number(axis));
    const Vec3 &step = lattice.steps[i], difference = block.steps[i] - step;
    const double squared = Dot(step, step), voxels = Dot(block.origin - lattice.origin, step) / squared;
    if (block.uneven[i].centres != lattice.uneven[i].centres) return wrong(axis, "its coordinates must be even, or the same");
    // From its first voxel to its last one the difference adds up.
    if (!(std::sqrt(Dot(difference, difference) / squared) * (block.size[axis] - 1) <= kMostUneven)) {
      return wrong(axis, fmt::format("its voxels are {:g} {:g} {:g} apart, must be {:g} {:g} {:g}", block.steps[i].x, block.steps[i].y,
                                     block.steps[i].z, step.x, step.y, step.z));
    }
    if (!(std::abs(voxels) <= kMaxVolumeSide && std::abs(voxels - std::round(voxels)) <= kMostUneven)) {
      return wrong(axis, fmt::format("its voxels begin at {:g}, must begin at a whole number in [-{}, {}], in voxels", voxels,
                                     kMaxVolumeSide, kMaxVolumeSide));
    }
    place[axis] = std::int32_t(std::round(voxels));
  }
  return place;
}

// Adds those of `block`, by the lattice of the pieces that are there.
Status AddPieces(const ParallelImage& block, ParallelImage& image) {
  if (block.piece_format != image.piece_format || block.header.components != image.header.components) {
    return Status::InvalidArgument(fmt::format("a {} with {} components, must be a {} with {}, as the first block", block.piece_format,
                                               block.header.components, image.piece_format, image.header.components));
  }
  const Result<Index3> place = PlaceOnLattice(image.header, block.header);
  if (!place.ok()) return place.status();
  for (const auto& [file, box] : block.pieces) image.pieces.push_back({file, {box.begin + *place, box.end + *place}});
  return Status::Ok();
}

}  // namespace

Result<ParallelImage> ReadImageBlocks(const std::string& path, const ReadOptions& options) {
  const Result<VtkList> list = ReadVtkList(path);
  if (!list.ok()) return list.status();
  ParallelImage image;
  std::vector<std::string> surfaces, lists;
  ReadOptions of_block = options;
  for (const auto& [file, name] : list->entries) {
    const auto within = [&](const Status& status) { return Status(status.code(), path + ": " + status.message()); };
    const Result<VtkList> found = ReadVtkList(file);
    if (!found.ok()) return within(found.status());
    if (found->OfSurfaces()) {
      surfaces.push_back(name);
      continue;
    }
    if (std::ranges::count(kVtkImageTypes, found->type) == 0) {
      return within(Status::InvalidArgument(
          fmt::format("{}: a VTK file of type '{}', must be {}", file, found->type, fmt::join(kVtkImageTypes, " or "))));
    }
    Result<ParallelImage> block = ReadParallelImage(file, found->type, of_block);
    if (!block.ok()) return within(block.status());
    if (!found->entries.empty()) lists.push_back(file);
    if (!image.pieces.empty()) {
      if (const Status status = AddPieces(*block, image); !status.ok()) {
        return within(Status::InvalidArgument(file + ": " + status.message()));
      }
      continue;
    }
    image = *std::move(block);
    of_block.array = image.array;
  }
  if (image.pieces.empty()) return Status::InvalidArgument(path + ": has no block with a voxel in it");
  Box bounds = image.pieces.front().box;
  for (const auto& piece : image.pieces) bounds = Hull(bounds, piece.box);
  for (auto& [file, box] : image.pieces) box = {box.begin - bounds.begin, box.end - bounds.begin};
  image.lists = std::move(lists);
  RawHeader& header = image.header;
  for (const Axis axis : kAxes) header.origin = header.origin + double(bounds.begin[axis]) * header.steps[std::size_t(Number(axis))];
  if (!surfaces.empty()) header.notes.push_back(SurfacesNote(surfaces));
  const Index3 size = bounds.size();
  const Status status = SetSize(header, path, {double(size.x), double(size.y), double(size.z)}, {});
  return status.ok() ? Result(std::move(image)) : status;
}

}  // namespace slabstream
