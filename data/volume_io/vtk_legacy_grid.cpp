// Unstructured and curvilinear grids in legacy VTK files (vtk_legacy_file.h).
#include <fmt/format.h>

#include <cmath>
#include <utility>

#include "data/volume_io/mesh_builder.h"
#include "data/volume_io/mesh_formats.h"
#include "data/volume_io/structured_cells.h"
#include "data/volume_io/vtk_legacy_file.h"

namespace slabstream {
namespace {

// Where the points of each cell end among those of all, and these.
struct CellPoints {
  WholeNumbers ends, corners;
};

constexpr std::string_view kCurvilinear = "STRUCTURED_GRID";
constexpr std::int64_t kMostCorners = std::int64_t{1} << 40;

class LegacyGridReader {
 public:
  LegacyGridReader(const std::string& path, VtkLegacyFile file) : path_(path), file_(std::move(file)) {}

  Result<LoadedMesh> Read(const MeshOptions& options) {
    const OfferedArrays offered = file_.Offered();
    const Result<std::size_t> chosen = builder_.SetArrays(path_, offered.arrays, options);
    if (!chosen.ok()) return chosen.status();
    if (options.headers_only) return builder_.TakeHeaders();
    if (Status status = ReadPoints(file_.arrays()[offered.numbers[*chosen]]); !status.ok()) return status;
    if (Status status = file_.kind() == kCurvilinear ? AddStructuredCells(grid_, builder_) : ReadCells(); !status.ok()) return status;
    Result<LoadedMesh> loaded = builder_.Finish(path_);
    if (loaded.ok()) loaded->info.format = fmt::format("VTK {}, legacy", file_.kind());
    return loaded;
  }

 private:
  // The dataset's own array of this name, in which there are between 1 and `most` tuples.
  Result<VtkLegacyArray> Own(const std::string& name, std::int64_t most) const {
    Result<VtkLegacyArray> array = file_.Own(name);
    if (array.ok() && (array->tuples < 1 || array->tuples > most)) {
      return file_.Wrong(fmt::format("{} has {} elements, must be in [1, {}]", name, array->tuples, most));
    }
    return array;
  }

  Result<WholeNumbers> Whole(const VtkLegacyArray& array) {
    const bool whole = array.supported && array.type != SampleType::kFloat32 && array.type != SampleType::kFloat64;
    if (whole && array.components == 1) return file_.ReadNumbers<std::int64_t>(array);
    return file_.Wrong(fmt::format("{} has no whole numbers", array.name));
  }

  Result<WholeNumbers> OfCells(const std::string& name, std::int64_t most) {
    const Result<VtkLegacyArray> array = Own(name, most);
    return array.ok() ? Whole(*array) : array.status();
  }

  Result<CellPoints> ReadCountedCells() {
    const Result<WholeNumbers> numbers = OfCells("CELLS", kMostCorners);
    if (!numbers.ok()) return numbers.status();
    CellPoints points;
    for (std::size_t at = 0; at < numbers->size();) {
      const std::int64_t count = (*numbers)[at++];
      if (count < 0 || count > std::int64_t(numbers->size() - at)) {
        return file_.Damaged(fmt::format("cell {} has {} points, CELLS holds {} more", points.ends.size(), count, numbers->size() - at));
      }
      points.corners.insert(points.corners.end(), numbers->data() + at, numbers->data() + at + std::size_t(count));
      points.ends.push_back(std::int64_t(points.corners.size()));
      at += std::size_t(count);
    }
    return points;
  }

  Result<CellPoints> ReadCellsWithOffsets() {
    Result<WholeNumbers> offsets = OfCells("OFFSETS", kMaxTetrahedra + 1), corners = OfCells("CONNECTIVITY", kMostCorners);
    for (const auto* numbers : {&offsets, &corners}) {
      if (!numbers->ok()) return numbers->status();
    }
    if (offsets->front() != 0) return file_.Damaged(fmt::format("OFFSETS begin with {}, must begin with 0", offsets->front()));
    offsets->erase(offsets->begin());
    return CellPoints{*std::move(offsets), *std::move(corners)};
  }

  // With their values, or those of the cells.
  Status ReadPoints(const VtkLegacyArray& values) {
    const Result<VtkLegacyArray> places = Own("POINTS", kMaxMeshPoints);
    if (!places.ok()) return places.status();
    if (file_.kind() == kCurvilinear) {
      if (Status status = FindGrid(places->tuples); !status.ok()) return status;
    }
    const std::int64_t cells = file_.kind() == kCurvilinear ? (grid_[0] - 1) * (grid_[1] - 1) * (grid_[2] - 1) : file_.cells();
    const auto suits = [&](const VtkLegacyArray& array) {
      const std::int64_t elements = array.section == "POINT_DATA" ? places->tuples : cells;
      if (array.tuples == elements) return Status::Ok();
      return file_.Damaged(fmt::format("{} has {} elements, the grid has {}", array.section, array.tuples, elements));
    };
    if (Status status = suits(values); !status.ok()) return status;
    MeshPiece piece;
    auto read_places = file_.ReadNumbers<double>(*places);
    if (!read_places.ok()) return read_places.status();
    piece.places = *std::move(read_places);
    auto read_values = file_.ReadNumbers<float>(values);
    if (!read_values.ok()) return read_values.status();
    piece.values = *std::move(read_values);
    for (const GhostMark& mark : kGhostMarks) {
      const std::string_view section = mark.at == ValuesAt::kPoints ? "POINT_DATA" : "CELL_DATA";
      for (const VtkLegacyArray& array : file_.arrays()) {
        if (array.section != section || array.name != mark.name) continue;
        if (Status status = suits(array); !status.ok()) return status;
        const Result<WholeNumbers> numbers = Whole(array);
        if (!numbers.ok()) return numbers.status();
        piece.Mark(mark, *numbers);
      }
    }
    return builder_.BeginPiece(path_, std::move(piece));
  }

  // The sizes of a curvilinear grid, which has so many points.
  Status FindGrid(std::int64_t points) {
    const Vec3 sizes = file_.Three("DIMENSIONS", {});
    for (const Axis axis : kAxes) {
      const double size = sizes[axis];
      if (!(size >= 1 && size <= double(kMaxMeshPoints) && size == std::floor(size))) {
        return file_.Wrong(
            fmt::format("DIMENSIONS has {} along {}, must be a whole number in [1, {}]", size, Letter(axis), kMaxMeshPoints));
      }
      grid_[std::size_t(Number(axis))] = std::int64_t(size);
    }
    if (Status status = CheckPointCount(path_, grid_); !status.ok()) return status;
    if (grid_[0] * grid_[1] * grid_[2] != points) {
      return file_.Damaged(fmt::format("has {} POINTS, its DIMENSIONS state {}", points, ToText(grid_)));
    }
    return HasVolume(grid_) ? Status::Ok() : file_.Wrong(fmt::format("is flat, {}, and so has no volume", ToText(grid_)));
  }

  Status ReadCells() {
    const Result<WholeNumbers> kinds = OfCells("CELL_TYPES", kMaxTetrahedra);
    if (!kinds.ok()) return kinds.status();
    const Result<CellPoints> points = file_.Own("CELLS").ok() ? ReadCountedCells() : ReadCellsWithOffsets();
    if (!points.ok()) return points.status();
    if (kinds->size() != points->ends.size() || kinds->size() != std::size_t(file_.cells())) {
      return file_.Damaged(fmt::format("CELLS states {} cells and has {}, CELL_TYPES has {}, must be one number", file_.cells(),
                                       points->ends.size(), kinds->size()));
    }
    const Result<std::int64_t> count = builder_.CheckCells(*kinds, points->ends);
    if (!count.ok()) return count.status();
    if (*count != std::int64_t(points->corners.size())) {
      return file_.Damaged(fmt::format("CONNECTIVITY has {} points of cells, must have {}", points->corners.size(), *count));
    }
    return builder_.AddCells(*kinds, points->corners);
  }

  const std::string& path_;
  VtkLegacyFile file_;
  MeshBuilder builder_;
  GridPoints grid_ = {};  // of a curvilinear grid
};

}  // namespace

Result<LoadedMesh> ReadVtkLegacyGrid(const std::string& path, const MeshOptions& options) {
  Result<VtkLegacyFile> file = VtkLegacyFile::Open(path, {"UNSTRUCTURED_GRID", kCurvilinear});
  if (!file.ok()) return file.status();
  return LegacyGridReader(path, *std::move(file)).Read(options);
}

}  // namespace slabstream
