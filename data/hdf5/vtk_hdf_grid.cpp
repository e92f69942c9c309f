// Unstructured grids of VTKHDF. Each block, which may be the whole file, has its pieces one behind the other in arrays of points, cells and
// values. Steps says of each time which pieces it has, and where in the arrays they begin; times may share points and cells.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <limits>
#include <optional>
#include <utility>

#include "data/hdf5/hdf5_rows.h"
#include "data/hdf5/vtk_hdf_mesh.h"
#include "data/volume_io/grid_volume.h"
#include "data/volume_io/mesh_builder.h"
#include "data/volume_io/stated_field.h"

namespace slabstream {
namespace {

constexpr std::string_view kRoot = "/VTKHDF", kGrid = "UnstructuredGrid";
constexpr std::array<std::string_view, 2> kOfBlocks = {"MultiBlockDataSet", "PartitionedDataSetCollection"};

std::string GroupOf(ValuesAt at) { return at == ValuesAt::kPoints ? "PointData" : "CellData"; }

// The arrays of a block.
class Block {
 public:
  Block(std::shared_ptr<Hdf5File> file, std::string path, SourceContext context)
      : file_(std::move(file)), path_(std::move(path)), context_(std::move(context)) {}

  const std::string& path() const { return path_; }
  bool Has(const std::string& name) const { return file_->Has(path_ + "/" + name); }
  std::string named(const std::string& name) const { return file_->Named(path_ + "/" + name); }

  Result<std::vector<GridArray>> Arrays() const {
    Result<std::vector<GridArray>> arrays = VtkHdfArrays(*file_, path_, ValuesAt::kPoints);
    const Result<std::vector<GridArray>> of_cells = VtkHdfArrays(*file_, path_, ValuesAt::kCells);
    if (!arrays.ok() || !of_cells.ok()) return arrays.ok() ? of_cells.status() : arrays.status();
    arrays->insert(arrays->end(), of_cells->begin(), of_cells->end());
    return arrays;
  }

  // `count` rows from `begin` on, of `columns` numbers each.
  template <class T>
  Result<AlignedVector<T>> Read(const std::string& name, std::int64_t begin, std::int64_t count, std::uint64_t columns = 1) const {
    return ReadRows<T>(file_, path_ + "/" + name, context_, begin, count, columns);
  }
  // All rows of it.
  Result<WholeNumbers> ReadAll(const std::string& name) const {
    const Result<DatasetFacts> facts = file_->Describe(path_ + "/" + name);
    return facts.ok() ? Read<std::int64_t>(name, 0, std::int64_t(facts->size[0])) : facts.status();
  }
  // A number of one time. `otherwise`: there is no such array.
  Result<std::int64_t> AtStep(const std::string& name, std::int64_t step, std::int64_t otherwise) const {
    if (!Has("Steps/" + name)) return otherwise;
    const Result<WholeNumbers> number = Read<std::int64_t>("Steps/" + name, step, 1);
    return number.ok() ? Result(number->front()) : number.status();
  }

 private:
  const std::shared_ptr<Hdf5File> file_;
  const std::string path_;
  const SourceContext context_;
};

// Where the next piece begins in the arrays, in their rows.
struct Place {
  std::int64_t part = 0, end_part = 0, points = 0, cells = 0, corners = 0, values = 0;
  std::array<std::int64_t, kGhostMarks.size()> marks{};
};

class GridReader {
 public:
  GridReader(std::shared_ptr<Hdf5File> file, const ReadOptions& options)
      : file_(std::move(file)), options_(options), context_(std::make_shared<ReadContext>(ReadContext::Limits{})) {}

  Result<RawVolume> Read() {
    const Result<VtkHdfTime> time = ChooseVtkHdfTime(*file_, options_);
    if (!time.ok()) return time.status();
    step_ = time->number;
    const auto files = [this] { return std::vector{file_->path()}; };
    Result<RawVolume> raw = GridVolume(file_->path(), options_, {files, [this](const MeshOptions& of) { return ReadMesh(of); }});
    if (!raw.ok()) return raw;
    raw->header.times = time->times;
    raw->header.number = step_;
    return raw;
  }

 private:
  Result<LoadedMesh> ReadMesh(MeshOptions options) {
    const Result<std::vector<Block>> blocks = Blocks();
    if (!blocks.ok()) return blocks.status();
    builder_ = MeshBuilder();
    array_.reset();
    options.array = VtkHdfArrayName(options_.dataset);
    for (const Block& block : *blocks) {
      if (!array_) {
        const Result<std::vector<GridArray>> arrays = block.Arrays();
        if (!arrays.ok()) return arrays.status();
        const Result<std::size_t> chosen = builder_.SetArrays(file_->path(), *arrays, options);
        if (!chosen.ok()) return chosen.status();
        array_ = (*arrays)[*chosen];
      }
      if (options.headers_only) break;
      if (Status status = ReadBlock(block); !status.ok()) return status;
    }
    Result<LoadedMesh> grid = options.headers_only ? builder_.TakeHeaders() : builder_.Finish(file_->path());
    if (!grid.ok()) return grid;
    std::error_code error;
    if (options.read) options.read(std::int64_t(std::filesystem::file_size(file_->path(), error)));
    grid->info.format = "VTKHDF";
    return grid;
  }

  Result<std::vector<Block>> Blocks() const {
    const std::string root(kRoot), type = VtkHdfType(*file_);
    if (type == kGrid) return std::vector{Block(file_, root, context_)};
    const Result<std::vector<std::string>> names = file_->Names(root);
    if (!names.ok()) return names.status();
    std::vector<Block> blocks;
    for (const std::string& name : *names) {
      const std::string path = root + "/" + name, of_block = file_->Text(path, "Type").value_or("");
      if (of_block.empty() || of_block == "PolyData") continue;
      if (of_block != kGrid) {
        return Status::InvalidArgument(fmt::format("{}: block '{}' is of type '{}', which is not supported; supported: {}", file_->path(),
                                                   Printable(name), Printable(of_block), kGrid));
      }
      blocks.emplace_back(file_, path, context_);
    }
    if (blocks.empty()) return Status::InvalidArgument(fmt::format("{}: has no block of type {}", file_->path(), kGrid));
    return blocks;
  }

  // Where the pieces of the time begin.
  Result<Place> PlaceOf(const Block& block, std::int64_t parts) const {
    Place at{.end_part = parts};
    if (!block.Has("Steps")) return at;
    Status status;
    const auto number = [&](const std::string& name, std::int64_t otherwise) {
      const Result<std::int64_t> found = block.AtStep(name, step_, otherwise);
      if (found.ok() && *found >= 0 && *found <= kMost) return *found;
      if (status.ok())
        status = found.ok() ? Status::DataLoss(fmt::format("{} has {}", block.named("Steps/" + name), *found)) : found.status();
      return std::int64_t{0};
    };
    // Values that say nothing else lie as their points or cells do.
    const auto of_values = [&](ValuesAt where, std::string_view name) {
      return number(fmt::format("{}Offsets/{}", GroupOf(where), name), where == ValuesAt::kPoints ? at.points : at.cells);
    };
    at.part = number("PartOffsets", 0);
    at.end_part = at.part + number("NumberOfParts", std::max<std::int64_t>(0, parts - at.part));
    at.points = number("PointOffsets", 0);
    at.cells = number("CellOffsets", 0);
    at.corners = number("ConnectivityIdOffsets", 0);
    at.values = of_values(array_->at, array_->name);
    for (std::size_t i = 0; i < kGhostMarks.size(); ++i) at.marks[i] = of_values(kGhostMarks[i].at, kGhostMarks[i].name);
    if (!status.ok()) return status;
    if (at.end_part <= parts) return at;
    return Status::DataLoss(
        fmt::format("{}: time {} has parts {} to {}, must be in [0, {}]", block.named("Steps"), step_, at.part, at.end_part, parts));
  }

  Status ReadBlock(const Block& block) {
    // By part: how many points, cells and points of cells.
    std::array<WholeNumbers, 3> counts;
    constexpr std::array kNames = {"NumberOfPoints", "NumberOfCells", "NumberOfConnectivityIds"};
    for (std::size_t i = 0; i < counts.size(); ++i) {
      Result<WholeNumbers> numbers = block.ReadAll(kNames[i]);
      if (!numbers.ok()) return numbers.status();
      counts[i] = *std::move(numbers);
      const bool sound = std::ranges::all_of(counts[i], [](std::int64_t n) { return n >= 0 && n <= kMost; });
      if (!sound || counts[i].size() != counts[0].size() || counts[i].size() > kMostParts) {
        return Status::DataLoss(fmt::format("{} must have a number from 0 on for each of {} parts, of which there are at most {}",
                                            block.named(kNames[i]), counts[0].size(), kMostParts));
      }
    }
    Result<Place> found = PlaceOf(block, std::int64_t(counts[0].size()));
    if (!found.ok()) return found.status();
    for (Place& at = *found; at.part < at.end_part; ++at.part) {
      const auto part = std::size_t(at.part);
      const std::int64_t points = counts[0][part], cells = counts[1][part], corners = counts[2][part];
      if (points > 0 && cells > 0) {
        if (Status status = ReadPart(block, at, points, cells, corners); !status.ok()) return status;
      }
      const auto of = [&](ValuesAt where) { return where == ValuesAt::kPoints ? points : cells; };
      at.points += points;
      at.cells += cells;
      at.corners += corners;
      at.values += of(array_->at);
      for (std::size_t i = 0; i < kGhostMarks.size(); ++i) at.marks[i] += of(kGhostMarks[i].at);
    }
    return Status::Ok();
  }

  Status ReadPart(const Block& block, const Place& at, std::int64_t points, std::int64_t cells, std::int64_t corners) {
    const std::string where = fmt::format("{}: part {}", block.named(""), at.part), values = GroupOf(array_->at) + "/" + array_->name;
    MeshPiece piece;
    Result<AlignedVector<double>> places = block.Read<double>("Points", at.points, points, 3);
    if (!places.ok()) return places.status();
    piece.places = *std::move(places);
    Result<AlignedVector<float>> read =
        block.Read<float>(values, at.values, array_->at == ValuesAt::kPoints ? points : cells, std::uint64_t(array_->components));
    if (!read.ok()) return read.status();
    piece.values = *std::move(read);
    for (std::size_t i = 0; i < kGhostMarks.size(); ++i) {
      const GhostMark& mark = kGhostMarks[i];
      const bool of_points = mark.at == ValuesAt::kPoints;
      const std::string name = GroupOf(mark.at) + "/" + std::string(mark.name);
      if (!block.Has(name)) continue;
      const Result<WholeNumbers> marks = block.Read<std::int64_t>(name, at.marks[i], of_points ? points : cells);
      if (!marks.ok()) return marks.status();
      piece.Mark(mark, *marks);
    }
    // Each part has one more offset than it has cells.
    const Result<WholeNumbers> kinds = block.Read<std::int64_t>("Types", at.cells, cells),
                               offsets = block.Read<std::int64_t>("Offsets", at.cells + at.part, cells + 1),
                               connectivity = block.Read<std::int64_t>("Connectivity", at.corners, corners);
    for (const auto* numbers : {&kinds, &offsets, &connectivity}) {
      if (!numbers->ok()) return numbers->status();
    }
    if (offsets->front() != 0 || offsets->back() != corners) {
      return Status::DataLoss(
          fmt::format("{}: Offsets reach from {} to {}, must reach from 0 to {}", where, offsets->front(), offsets->back(), corners));
    }
    if (Status status = builder_.BeginPiece(where, std::move(piece)); !status.ok()) return status;
    const Result<std::int64_t> count = builder_.CheckCells(*kinds, {offsets->begin() + 1, offsets->end()});
    return count.ok() ? builder_.AddCells(*kinds, *connectivity) : count.status();
  }

  // Of points and cells of a part, and of parts: sums fit.
  static constexpr std::int64_t kMost = std::int64_t{1} << 40;
  static constexpr std::size_t kMostParts = std::size_t{1} << 20;
  const std::shared_ptr<Hdf5File> file_;
  const ReadOptions& options_;
  const SourceContext context_;
  std::int64_t step_ = 0;
  MeshBuilder builder_;
  std::optional<GridArray> array_;  // the chosen one, as the first block has it
};

}  // namespace

std::string VtkHdfType(AttributedFile& file) { return file.Text(std::string(kRoot), "Type").value_or(""); }

Result<std::vector<GridArray>> VtkHdfArrays(AttributedFile& file, const std::string& block, ValuesAt at) {
  const std::string group = block + "/" + GroupOf(at), active = file.Text(group, "Scalars").value_or("");
  const Result<std::vector<std::string>> names = file.Names(group);
  if (!names.ok()) return names.status();
  std::vector<GridArray> arrays;
  for (const std::string& name : *names) {
    const std::string path = group + "/" + name;
    GridArray array{.name = name, .at = at, .active = name == active || file.Text(path, "Attribute") == "Scalars"};
    if (const Result<DatasetFacts> facts = file.Describe(path); facts.ok()) {
      array.type = facts->type;
      if (facts->size.size() == 2) array.components = int(std::min<std::uint64_t>(facts->size[1], std::numeric_limits<int>::max()));
    } else {
      array.type = std::nullopt;
      array.type_name = "another type";
    }
    arrays.push_back(std::move(array));
  }
  return arrays;
}

Result<VtkHdfTime> ChooseVtkHdfTime(AttributedFile& file, const ReadOptions& options) {
  const std::string steps = std::string(kRoot) + "/Steps";
  VtkHdfTime time;
  if (file.Has(steps)) {
    const Result<std::vector<double>> values = file.SmallDataset(steps + "/Values");
    if (!values.ok()) return values.status();
    time.times = StatedTimes(std::int64_t(values->size()), *values, "");
  }
  const Result<std::int64_t> number = ChosenVolume(file.path(), time.times.count, options);
  if (!number.ok()) return number.status();
  time.number = *number;
  return time;
}

bool IsVtkHdfGrid(const std::string& type) { return type == kGrid || std::ranges::find(kOfBlocks, type) != kOfBlocks.end(); }

std::string VtkHdfArrayName(const std::string& dataset) { return dataset.substr(dataset.rfind('/') + 1); }

Result<RawVolume> ReadVtkHdfGrid(const std::shared_ptr<Hdf5File>& file, const ReadOptions& options) {
  return GridReader(file, options).Read();
}

}  // namespace slabstream
