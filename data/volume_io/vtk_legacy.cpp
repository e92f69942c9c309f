// Legacy VTK files of structured points and of rectilinear grids (.vtk).
#include <fmt/format.h>

#include <array>
#include <string>
#include <string_view>
#include <vector>

#include "data/volume_io/formats.h"
#include "data/volume_io/structured_grid.h"
#include "data/volume_io/vtk_legacy_file.h"

namespace slabstream {
namespace {

constexpr std::string_view kImage = "STRUCTURED_POINTS", kRectilinear = "RECTILINEAR_GRID";

Result<PointGrid> GridOf(VtkLegacyFile& file) {
  const Vec3 points = file.Three("DIMENSIONS", {});
  if (file.kind() == kImage) {
    return PointGrid{.points = {points.x, points.y, points.z},
                     .steps = StepsOf(file.Three("SPACING", {1, 1, 1})),
                     .origin = file.Three("ORIGIN", {}),
                     .matrix = "SPACING"};
  }
  std::array<std::vector<double>, 3> coordinates;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::string name = std::string(1, "XYZ"[axis]) + "_COORDINATES";
    const Result<VtkLegacyArray> array = file.Own(name);
    if (!array.ok()) return array.status();
    if (double(array->tuples) != points[int(axis)] || array->tuples < 1) {
      return file.Wrong(fmt::format("{} has {} coordinates, DIMENSIONS {}", name, array->tuples, points[int(axis)]));
    }
    const auto numbers = file.ReadNumbers<double>(*array);
    if (!numbers.ok()) return numbers.status();
    coordinates[axis].assign(numbers->begin(), numbers->end());
  }
  return GridOfCoordinates(coordinates);
}

Result<RawVolume> Read(const std::string& path, const ReadOptions& options) {
  Result<VtkLegacyFile> file = VtkLegacyFile::Open(path, {kImage, kRectilinear});
  if (!file.ok()) return file.status();
  const OfferedArrays offered = file->Offered();
  const Result<std::size_t> chosen = ChooseArray(path, offered.arrays, options.array);
  if (!chosen.ok()) return chosen.status();
  const VtkLegacyArray& array = file->arrays()[offered.numbers[*chosen]];
  const Result<PointGrid> grid = GridOf(*file);
  if (!grid.ok()) return grid.status();
  RawHeader header;
  if (Status status = SetGrid(header, path, *grid, offered.arrays[*chosen].at); !status.ok()) return status;
  const std::int64_t voxels = VolumeGeometry{header.size}.bounds().voxel_count();
  if (array.tuples != voxels) {
    return file->Wrong(fmt::format("{} has {} elements, the grid of its DIMENSIONS {}", array.section, array.tuples, voxels));
  }
  header.notes = NotesOf(offered.arrays, *chosen);
  header.type = array.type;
  header.components = array.components;
  if (Status status = file->CheckHolds(array); !status.ok()) return status;
  Result<RawVolume> raw = TakeMemory(path, header, options);
  if (!raw.ok() || options.headers_only) return raw;
  if (Status status = file->ReadSamples(array, raw->bytes); !status.ok()) return status;
  return raw;
}

}  // namespace

VolumeFormat VtkLegacy() { return {.name = "VTK", .endings = {".vtk"}, .options = {"channel", "array", "resample"}, .read = Read}; }

}  // namespace slabstream
