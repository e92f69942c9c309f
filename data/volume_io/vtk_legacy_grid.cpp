// Unstructured grids in legacy VTK files (vtk_legacy_file.h).
#include <fmt/format.h>

#include <utility>

#include "data/volume_io/mesh_builder.h"
#include "data/volume_io/mesh_formats.h"
#include "data/volume_io/vtk_legacy_file.h"

namespace slabstream {
namespace {

using WholeNumbers = AlignedVector<std::int64_t>;

// Where the points of each cell end among those of all, and these.
struct CellPoints {
  WholeNumbers ends, corners;
};

constexpr std::int64_t kMostCorners = std::int64_t{1} << 40;

class LegacyGridReader {
 public:
  LegacyGridReader(const std::string& path, VtkLegacyFile file)
      : path_(path), file_(std::move(file)), builder_(path, "VTK unstructured grid, legacy") {}

  Result<LoadedMesh> Read(const MeshOptions& options) {
    const OfferedArrays offered = file_.Offered();
    const Result<std::size_t> chosen = builder_.SetArrays(offered.arrays, options);
    if (!chosen.ok()) return chosen.status();
    if (options.headers_only) return builder_.Take();
    const VtkLegacyArray& array = file_.arrays()[offered.numbers[*chosen]];
    if (Status status = ReadPoints(); !status.ok()) return status;
    if (Status status = ReadCells(); !status.ok()) return status;
    const bool of_points = array.section == "POINT_DATA";
    if (const std::int64_t elements = of_points ? file_.Own("POINTS")->tuples : file_.cells(); array.tuples != elements) {
      return file_.Damaged(fmt::format("{} has {} elements, the grid has {}", array.section, array.tuples, elements));
    }
    const Result<AlignedVector<float>> values = file_.ReadNumbers<float>(array);
    if (!values.ok()) return values.status();
    if (Status status = builder_.SetValues(*values); !status.ok()) return status;
    return builder_.Take();
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

  Result<WholeNumbers> OfCells(const std::string& name, std::int64_t most) {
    const Result<VtkLegacyArray> array = Own(name, most);
    if (!array.ok()) return array.status();
    if (array->type == SampleType::kFloat32 || array->type == SampleType::kFloat64) {
      return file_.Wrong(fmt::format("{} has no whole numbers", name));
    }
    return file_.ReadNumbers<std::int64_t>(*array);
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

  Status ReadPoints() {
    const Result<VtkLegacyArray> array = Own("POINTS", kMaxMeshPoints);
    if (!array.ok()) return array.status();
    const Result<AlignedVector<double>> places = file_.ReadNumbers<double>(*array);
    return places.ok() ? builder_.SetPoints(*places) : places.status();
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
    if (Status status = builder_.SetCells(*kinds, points->ends); !status.ok()) return status;
    if (points->ends.back() != std::int64_t(points->corners.size())) {
      return file_.Damaged(fmt::format("CONNECTIVITY has {} points of cells, must have {}", points->corners.size(), points->ends.back()));
    }
    return builder_.AddCorners(points->corners, 0, file_.Own("POINTS")->tuples);
  }

  const std::string& path_;
  VtkLegacyFile file_;
  MeshBuilder builder_;
};

}  // namespace

Result<LoadedMesh> ReadVtkLegacyGrid(const std::string& path, const MeshOptions& options) {
  Result<VtkLegacyFile> file = VtkLegacyFile::Open(path, {"UNSTRUCTURED_GRID"});
  if (!file.ok()) return file.status();
  return LegacyGridReader(path, *std::move(file)).Read(options);
}

}  // namespace slabstream
