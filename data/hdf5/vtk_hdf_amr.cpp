// Adaptive meshes of VTKHDF. LevelN has the boxes of its level (AMRBox: the first and the last cell along x, y and z, counted from the
// origin of the file), and for each array the values of all boxes, one box behind the other. Steps says of each time which boxes a level
// has, and where their values begin.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "data/hdf5/hdf5_rows.h"
#include "data/hdf5/vtk_hdf_mesh.h"
#include "data/mosaic/adaptive_mesh.h"
#include "data/sources/array_numbers.h"
#include "data/sources/chunked_source.h"
#include "data/sources/file_array.h"
#include "data/volume_io/chosen_channel.h"
#include "data/volume_io/grid_arrays.h"

namespace slabstream {
namespace {

constexpr std::string_view kRoot = "/VTKHDF";
constexpr int kMostLevels = 16;

// A box of a level: a stretch of an array with the values of all boxes. Chunks are some of its slices.
class BoxArray : public ChunkedArray, public std::enable_shared_from_this<BoxArray> {
 public:
  // `begin`: of its values. `channel`: of an array with components.
  BoxArray(std::string named, std::shared_ptr<ChunkedArray> values, std::uint64_t begin, const Index3& cells, int channel)
      : named_(std::move(named)), values_(std::move(values)), begin_(begin), channel_(std::uint64_t(channel)) {
    shape_.size = {std::uint64_t(cells.z), std::uint64_t(cells.y), std::uint64_t(cells.x)};
    shape_.type = values_->shape().type;
    const std::uint64_t slice = shape_.size[1] * shape_.size[2], most = kFileSliceBytes / BytesPerSample(shape_.type);
    shape_.chunk = {std::clamp<std::uint64_t>(most / slice, 1, shape_.size[0]), shape_.size[1], shape_.size[2]};
    shape_.cut_at_end = true;
    shape_.fill = values_->shape().fill;
  }

  const ArrayShape& shape() const override { return shape_; }

  void ReadChunk(std::span<const std::uint64_t> index, ChunkDone done, StillWanted /*wanted*/) override {
    const std::uint64_t first = index[0] * shape_.chunk[0], slice = shape_.size[1] * shape_.size[2];
    ArrayBox box{{begin_ + first * slice}, {std::min(shape_.chunk[0], shape_.size[0] - first) * slice}};
    if (values_->shape().size.size() == 2) {
      box.begin.push_back(channel_);
      box.count.push_back(1);
    }
    ReadElements(named_, values_, box, [done = std::move(done)](Result<AlignedVector<std::byte>> elements) {
      if (!elements.ok()) return done(elements.status());
      const std::uint64_t bytes = elements->size();
      done(std::optional(StoredChunk{Bytes(*std::move(elements)), bytes}));
    });
  }

 private:
  const std::string named_;
  const std::shared_ptr<ChunkedArray> values_;
  const std::uint64_t begin_, channel_;
  ArrayShape shape_;
};

struct Level {
  std::string path;        // "/VTKHDF/Level0"
  Vec3 spacing;            // > 0
  std::vector<Box> boxes;  // of cells, from the origin of the file
  std::int64_t begin = 0;  // of the values of the first of them
};

class AmrOpener {
 public:
  AmrOpener(std::shared_ptr<Hdf5File> file, const ReadOptions& options, SourceContext context)
      : file_(std::move(file)), options_(options), context_(std::move(context)) {}

  Result<std::shared_ptr<VolumeSource>> Open() {
    const Result<VtkHdfTime> time = ChooseVtkHdfTime(*file_, options_);
    if (!time.ok()) return time.status();
    info_.times = time->times;
    info_.time = int(time->number);
    if (Status status = ChooseValues(); !status.ok()) return status;
    for (int number = 0; file_->Has(fmt::format("{}/Level{}", kRoot, number)); ++number) {
      if (number == kMostLevels) return Wrong(fmt::format("has more than {} levels", kMostLevels));
      Result<Level> level = ReadLevel(number);
      if (!level.ok()) return level.status();
      // A time may have fewer levels than another one.
      if (level->boxes.empty()) break;
      levels_.push_back(*std::move(level));
    }
    if (levels_.empty()) return Wrong("has no level 0");
    return MakeSource();
  }

 private:
  Status Wrong(const std::string& why) const { return Status::InvalidArgument(file_->path() + ": " + why); }

  // The array is named by level 0.
  Status ChooseValues() {
    const Result<std::vector<GridArray>> found = VtkHdfArrays(*file_, std::string(kRoot) + "/Level0", ValuesAt::kCells);
    if (!found.ok()) return found.status();
    const std::vector<GridArray>& arrays = *found;
    const Result<std::size_t> chosen = ChooseArray(file_->path(), arrays, VtkHdfArrayName(options_.dataset));
    if (!chosen.ok()) return chosen.status();
    if (const int components = arrays[*chosen].components; components > kMaxComponents) {
      return Wrong(
          fmt::format("array '{}' has {} components, must have at most {}", Printable(arrays[*chosen].name), components, kMaxComponents));
    }
    name_ = arrays[*chosen].name;
    info_.notes = NotesOf(arrays, *chosen);
    std::vector<FieldInfo> channels(std::size_t(arrays[*chosen].components));
    const Result<int> channel = ChosenChannel(file_->path(), channels, options_);
    if (!channel.ok()) return channel.status();
    info_.channel = *channel;
    if (channels.size() > 1) {
      info_.components = int(channels.size());
      info_.channels = std::move(channels);
    }
    return Status::Ok();
  }

  // A number of the time, at least 0.
  Result<std::int64_t> AtStep(const std::string& dataset) const {
    constexpr std::int64_t kMost = std::int64_t{1} << 50;
    const Result<AlignedVector<std::int64_t>> number = ReadRows<std::int64_t>(file_, dataset, context_, info_.time, 1);
    if (!number.ok()) return number.status();
    if (number->front() < 0 || number->front() > kMost)
      return Status::DataLoss(fmt::format("{} has {}, must be in [0, {}]", file_->Named(dataset), number->front(), kMost));
    return number->front();
  }

  Result<Level> ReadLevel(int number) const {
    Level level{.path = fmt::format("{}/Level{}", kRoot, number)};
    const std::vector<double> spacing = file_->Numbers(level.path, "Spacing").value_or(std::vector<double>());
    const auto is_length = [](double length) { return length > 0 && std::isfinite(length); };
    if (spacing.size() != 3 || !std::ranges::all_of(spacing, is_length)) {
      return Wrong(fmt::format("Spacing of level {} must be 3 numbers above 0", number));
    }
    level.spacing = {spacing[0], spacing[1], spacing[2]};
    const std::string boxes = level.path + "/AMRBox";
    const Result<DatasetFacts> facts = file_->Describe(boxes);
    if (!facts.ok()) return facts.status();
    std::int64_t first = 0, count = std::int64_t(facts->size[0]);
    if (info_.times.count > 1 || file_->Has(std::string(kRoot) + "/Steps")) {
      const std::string steps = fmt::format("{}/Steps/Level{}/", kRoot, number);
      const Result<std::int64_t> at = AtStep(steps + "AMRBoxOffset"), of = AtStep(steps + "NumberOfAMRBox"),
                                 begin = AtStep(steps + "CellDataOffset/" + name_);
      for (const auto* each : {&at, &of, &begin}) {
        if (!each->ok()) return each->status();
      }
      first = *at;
      count = *of;
      level.begin = *begin;
    }
    if (count > std::int64_t{kMaxMosaicParts})
      return Wrong(fmt::format("level {} has {} boxes, must have at most {}", number, count, kMaxMosaicParts));
    const Result<AlignedVector<std::int64_t>> corners = ReadRows<std::int64_t>(file_, boxes, context_, first, count, 6);
    if (!corners.ok()) return corners.status();
    for (std::size_t i = 0; i < std::size_t(count); ++i) {
      Box box;
      for (int axis = 0; axis < 3; ++axis) {
        const std::int64_t low = (*corners)[6 * i + 2 * std::size_t(axis)], high = (*corners)[6 * i + 2 * std::size_t(axis) + 1];
        constexpr std::int64_t kMost = std::numeric_limits<std::int32_t>::max() / 4;
        if (low < -kMost || high > kMost || high < low || high - low >= kMaxVolumeSide) {
          return Wrong(fmt::format("box {} of level {} is from {} to {} along {}", i, number, low, high, Letter(kAxes[std::size_t(axis)])));
        }
        box.begin[axis] = std::int32_t(low);
        box.end[axis] = std::int32_t(high + 1);
      }
      level.boxes.push_back(box);
    }
    return level;
  }

  Result<std::shared_ptr<VolumeSource>> MakeSource() {
    const std::vector<double> origin = file_->Numbers(std::string(kRoot), "Origin").value_or(std::vector<double>{0, 0, 0});
    if (origin.size() != 3) return Wrong("Origin must be 3 numbers");
    info_.format = "VTKHDF OverlappingAMR";
    info_.files = {file_->path()};
    std::vector<MeshLevel> mesh;
    for (const Level& level : levels_) {
      Result<std::vector<MosaicPart>> parts = PartsOf(level);
      if (!parts.ok()) return parts.status();
      mesh.push_back({level.spacing, *std::move(parts)});
    }
    return MakeAdaptiveMesh(file_->path(), std::move(info_), {origin[0], origin[1], origin[2]}, std::move(mesh));
  }

  Result<std::vector<MosaicPart>> PartsOf(const Level& level) {
    const std::string path = level.path + "/CellData/" + name_;
    const Result<std::shared_ptr<ChunkedArray>> values = OpenRows(file_, path, std::uint64_t(info_.components), context_);
    if (!values.ok()) return values.status();
    const ArrayShape& shape = (*values)->shape();
    info_.exact = {shape.type, {}};
    info_.file_type = ToString(shape.type);
    std::vector<MosaicPart> parts;
    std::int64_t begin = level.begin;
    for (const Box& box : level.boxes) {
      const std::string named = fmt::format("{}: box {}", file_->Named(path), parts.size());
      const Result<ArrayBox> rows = RowsOf(shape, named, begin, box.voxel_count());
      if (!rows.ok()) return rows.status();
      const auto open = [named, values = *values, begin, cells = box.size(), channel = info_.channel, context = context_] {
        PyramidLevel voxels{.array = std::make_shared<BoxArray>(named, values, std::uint64_t(begin), cells, channel), .at = {0, 0, 0}};
        return MakeChunkedSource(named, {.levels = {std::move(voxels)}}, context);
      };
      parts.push_back({named, box, open});
      begin += box.voxel_count();
    }
    return parts;
  }

  const std::shared_ptr<Hdf5File> file_;
  const ReadOptions& options_;
  const SourceContext context_;
  std::string name_;           // of the array
  std::vector<Level> levels_;  // coarsest first
  SourceInfo info_;
};

}  // namespace

Result<std::shared_ptr<VolumeSource>> OpenVtkHdfAmr(const std::shared_ptr<Hdf5File>& file, const ReadOptions& options,
                                                    const SourceContext& context) {
  return AmrOpener(file, options, context).Open();
}

}  // namespace slabstream
