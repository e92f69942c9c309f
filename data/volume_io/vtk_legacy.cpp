// Legacy VTK files of structured points (.vtk). Their samples are the first scalars of the points, or the only array of a field there.
#include <fmt/format.h>

#include <algorithm>
#include <string>
#include <vector>

#include "data/volume_io/formats.h"
#include "data/volume_io/vtk_legacy_file.h"

namespace slabstream {
namespace {

// The one array that is read, or an error that names what there is.
Result<VtkLegacyArray> ChosenArray(const VtkLegacyFile& file) {
  std::vector<const VtkLegacyArray*> of_points;
  for (const VtkLegacyArray& array : file.arrays()) {
    if (array.section == "POINT_DATA") of_points.push_back(&array);
  }
  const auto scalars = std::ranges::find_if(of_points, [](const VtkLegacyArray* array) { return array->scalars; });
  if (scalars != of_points.end()) return **scalars;
  if (of_points.size() == 1) return *of_points.front();
  std::string names;
  for (const VtkLegacyArray* array : of_points) names.append(names.empty() ? "" : ", ").append(array->name);
  if (!names.empty()) return file.Wrong("has no scalars, and several arrays, must have one: " + names);
  const bool of_cells = std::ranges::any_of(file.arrays(), [](const VtkLegacyArray& array) { return array.section == "CELL_DATA"; });
  return file.Wrong(of_cells ? "its samples belong to cells (CELL_DATA), must belong to points; ParaView's filter Cell Data to Point Data "
                               "makes them so"
                             : "has no samples of points (POINT_DATA)");
}

Result<RawVolume> Read(const std::string& path, const ReadOptions& options) {
  Result<VtkLegacyFile> file = VtkLegacyFile::Open(path, "STRUCTURED_POINTS", VtkLegacyFile::Until::kScalarsOfPoints);
  if (!file.ok()) return file.status();
  const Result<VtkLegacyArray> array = ChosenArray(*file);
  if (!array.ok()) return array.status();
  RawHeader header;
  const Vec3 size = file->Three("DIMENSIONS", {});
  if (Status status = SetSize(header, path, {size.x, size.y, size.z}, options); !status.ok()) return status;
  const std::int64_t voxels = VolumeGeometry{header.size}.bounds().voxel_count();
  if (array->tuples != voxels) return file->Wrong(fmt::format("POINT_DATA has {} points, DIMENSIONS {}", array->tuples, voxels));
  header.type = array->type;
  header.components = array->components;
  header.world = World::kScene;
  header.matrix = "SPACING";
  header.steps = StepsOf(file->Three("SPACING", {1, 1, 1}));
  header.origin = file->Three("ORIGIN", {});
  if (Status status = file->CheckHolds(*array); !status.ok()) return status;
  Result<RawVolume> raw = TakeMemory(path, header, options);
  if (!raw.ok() || options.headers_only) return raw;
  if (Status status = file->ReadSamples(*array, raw->bytes); !status.ok()) return status;
  return raw;
}

}  // namespace

VolumeFormat VtkLegacy() { return {.name = "VTK", .endings = {".vtk"}, .options = {"channel"}, .read = Read}; }

}  // namespace slabstream
