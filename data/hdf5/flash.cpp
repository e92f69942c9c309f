// Files of FLASH: an adaptive mesh of blocks of equal numbers of cells, all in one array for each variable. "refine level" and "bounding
// box" say of each block how fine it is and where it lies. Coarser blocks beneath finer ones have values, too. Source: the user's guide of
// FLASH, and how yt reads such files (frontends/flash).
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>
#include <vector>

#include "data/hdf5/hdf5_layouts.h"
#include "data/hdf5/hdf5_rows.h"
#include "data/mosaic/adaptive_mesh.h"
#include "data/volume_io/grid_arrays.h"

namespace slabstream {
namespace {

const std::string kLevels = "/refine level", kBoxes = "/bounding box", kKinds = "/node type";

class FlashOpener {
 public:
  FlashOpener(std::shared_ptr<Hdf5File> file, const ReadOptions& options, SourceContext context)
      : file_(std::move(file)), options_(options), context_(std::move(context)) {}

  Result<std::shared_ptr<VolumeSource>> Open() {
    const Result<DatasetFacts> levels = file_->Describe(kLevels);
    if (!levels.ok()) return levels.status();
    blocks_ = levels->size[0];
    if (Status status = ChooseVariable(); !status.ok()) return status;
    if (Status status = ReadBlocks(); !status.ok()) return status;
    std::vector<MeshLevel> mesh;
    for (const auto& [level, blocks] : by_level_) {
      // A run may begin at a level above the first one.
      Result<MeshLevel> made = LevelOf(blocks);
      if (!made.ok()) return made.status();
      mesh.push_back(*std::move(made));
    }
    info_.format = "FLASH";
    info_.file_type = ToString(values_->shape().type);
    info_.exact = {values_->shape().type, {}};
    info_.files = {file_->path()};
    return MakeAdaptiveMesh(file_->path(), std::move(info_), low_, std::move(mesh));
  }

 private:
  Status Wrong(const std::string& why) const { return Status::InvalidArgument(file_->path() + ": " + why); }

  // Variables are arrays of blocks, z, y and x.
  Status ChooseVariable() {
    const Result<std::vector<std::string>> names = file_->Names("/");
    if (!names.ok()) return names.status();
    std::vector<GridArray> arrays;
    for (const std::string& name : *names) {
      const Result<DatasetFacts> facts = file_->Describe("/" + name);
      if (facts.ok() && facts->size.size() == 4 && facts->size[0] == blocks_) {
        arrays.push_back({.name = name, .at = ValuesAt::kCells, .type = facts->type});
      }
    }
    const Result<std::size_t> chosen = ChooseArray(file_->path(), arrays, options_.dataset);
    if (!chosen.ok()) return chosen.status();
    info_.notes = NotesOf(arrays, *chosen);
    Result<std::shared_ptr<Hdf5Dataset>> dataset = file_->Dataset("/" + arrays[*chosen].name);
    if (!dataset.ok()) return dataset.status();
    const std::vector<std::uint64_t> size = (*dataset)->size();
    for (std::size_t axis = 1; axis < 4; ++axis) {
      if (size[axis] > std::uint64_t(kMaxVolumeSide)) return Wrong(fmt::format("its blocks have {} cells along an axis", size[axis]));
    }
    cells_ = {std::int32_t(size[3]), std::int32_t(size[2]), std::int32_t(size[1])};
    named_ = (*dataset)->named();
    Result<std::shared_ptr<ChunkedArray>> values = MakeHdf5Array(*std::move(dataset), context_);
    if (values.ok()) values_ = *std::move(values);
    return values.status();
  }

  Status ReadBlocks() {
    const Result<DatasetFacts> boxes = file_->Describe(kBoxes);
    if (!boxes.ok()) return boxes.status();
    if (boxes->size != std::vector<std::uint64_t>{blocks_, 3, 2}) {
      return Wrong(fmt::format("its bounding boxes are of {}, must be of {} x 3 x 2", fmt::join(boxes->size, " x "), blocks_));
    }
    if (blocks_ > kMaxMosaicParts) return Wrong(fmt::format("has {} blocks, must have at most {}", blocks_, kMaxMosaicParts));
    const Result<std::shared_ptr<ChunkedArray>> array = file_->Array(kBoxes, context_, std::nullopt);
    if (!array.ok()) return array.status();
    Result<AlignedVector<double>> corners = ReadNumbers<double>(file_->Named(kBoxes), *array, {{0, 0, 0}, {blocks_, 3, 2}});
    if (!corners.ok()) return corners.status();
    const auto levels = ReadRows<std::int64_t>(file_, kLevels, context_, 0, std::int64_t(blocks_));
    if (!levels.ok()) return levels.status();
    corners_ = *std::move(corners);
    if (!std::ranges::all_of(corners_, [](double corner) { return std::isfinite(corner); })) {
      return Wrong("has a bounding box that is not finite");
    }
    for (std::uint64_t block = 0; block < blocks_; ++block) by_level_[(*levels)[block]].push_back(block);
    constexpr std::size_t kMostLevels = 32;
    if (by_level_.size() > kMostLevels) return Wrong(fmt::format("has {} levels, must have at most {}", by_level_.size(), kMostLevels));
    low_ = Corner(0, 0);
    for (std::uint64_t block = 0; block < blocks_; ++block) {
      for (int axis = 0; axis < 3; ++axis) low_[axis] = std::min(low_[axis], Corner(block, 0)[axis]);
    }
    return Status::Ok();
  }
  // The lower (0) or upper (1) corner of a block.
  Vec3 Corner(std::uint64_t block, std::uint64_t upper) const {
    const double* const of_block = corners_.data() + 6 * block + upper;
    return {of_block[0], of_block[2], of_block[4]};
  }

  Result<MeshLevel> LevelOf(const std::vector<std::uint64_t>& blocks) const {
    constexpr double kMostOff = 0.05;  // of a cell
    MeshLevel level{.spacing = (Corner(blocks.front(), 1) - Corner(blocks.front(), 0)) / ToVec3(cells_), .parts = {}};
    for (const std::uint64_t block : blocks) {
      Box box;
      for (const Axis axis : kAxes) {
        const double begin = (Corner(block, 0)[axis] - low_[axis]) / level.spacing[axis],
                     end = (Corner(block, 1)[axis] - low_[axis]) / level.spacing[axis];
        if (!(level.spacing[axis] > 0 && std::abs(begin - std::round(begin)) <= kMostOff && begin < kMaxVolumeSide &&
              std::abs(end - begin - cells_[axis]) <= kMostOff)) {
          return Wrong(fmt::format("block {} does not lie on cells of its level along {}", block, Letter(axis)));
        }
        box.begin[axis] = std::int32_t(std::round(begin));
        box.end[axis] = box.begin[axis] + cells_[axis];
      }
      const std::string named = fmt::format("{}: block {}", named_, block);
      const auto open = [named, values = values_, block, context = context_] {
        PyramidLevel voxels{.array = values, .axes = {3, 2, 1}, .at = {block, 0, 0, 0}};
        return MakeChunkedSource(named, {.levels = {std::move(voxels)}}, context);
      };
      level.parts.push_back({named, box, open});
    }
    return level;
  }

  const std::shared_ptr<Hdf5File> file_;
  const ReadOptions& options_;
  const SourceContext context_;
  std::uint64_t blocks_ = 0;
  Index3 cells_;       // of a block
  std::string named_;  // the array of the variable
  std::shared_ptr<ChunkedArray> values_;
  AlignedVector<double> corners_;  // of each block: from and to along x, y and z
  Vec3 low_;                       // the corner of all blocks
  std::map<std::int64_t, std::vector<std::uint64_t>> by_level_;
  SourceInfo info_;
};

}  // namespace

bool IsFlash(AttributedFile& file) { return file.Has(kLevels) && file.Has(kBoxes) && file.Has(kKinds); }

Result<std::shared_ptr<VolumeSource>> OpenFlash(const std::shared_ptr<Hdf5File>& file, const ReadOptions& options,
                                                const SourceContext& context) {
  return FlashOpener(file, options, context).Open();
}

}  // namespace slabstream
