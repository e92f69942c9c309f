// Image data of VTKHDF: VTKHDF/PointData and CellData, and attributes of VTKHDF as those of .vti files. Axes of a dataset are z, y and x;
// the steps of a series lie before them, the components of a voxel behind them. Source:
// https://docs.vtk.org/en/latest/vtk_file_formats/vtkhdf_file_format/index.html
#include <fmt/format.h>

#include <algorithm>

#include "data/hdf5/hdf5_image.h"
#include "data/volume_io/even_steps.h"

namespace slabstream {
namespace {

const std::string kRoot = "/VTKHDF";
const std::string kPointData = "/VTKHDF/PointData", kCellData = "/VTKHDF/CellData";

Result<std::vector<std::string>> Images(AttributedFile& file) {
  if (!file.Has(kRoot)) return std::vector<std::string>{};
  const std::string type = file.Text(kRoot, "Type").value_or("");
  if (type != "ImageData") {
    return Status::InvalidArgument(
        fmt::format("{}: is a VTKHDF file of type '{}', which is not supported; supported: ImageData, UnstructuredGrid, blocks of it "
                    "(MultiBlockDataSet, PartitionedDataSetCollection), and OverlappingAMR",
                    file.path(), Printable(type)));
  }
  std::vector<std::string> images;
  for (const std::string& group : {kPointData, kCellData}) {
    if (const auto active = file.Text(group, "Scalars"); active && file.Has(group + "/" + *active))
      return std::vector{group + "/" + *active};
    const Result<std::vector<std::string>> names = file.Names(group);
    if (!names.ok()) return names.status();
    for (const std::string& name : *names) images.push_back(group + "/" + name);
  }
  if (images.empty()) return Status::InvalidArgument(file.path() + ": is a VTKHDF file without an array of points or cells");
  return images;
}

Result<std::optional<ImageDescription>> Describe(AttributedFile& file, const DatasetFacts& dataset) {
  const std::string& path = dataset.path;
  const bool cells = path.starts_with(kCellData + "/");
  if (!cells && !path.starts_with(kPointData + "/")) return std::optional<ImageDescription>();
  const auto numbers = [&](const char* name, std::vector<double> otherwise) {
    return file.Numbers(kRoot, name).value_or(std::move(otherwise));
  };
  const std::vector<double> extent = numbers("WholeExtent", {}), origin = numbers("Origin", {0, 0, 0}),
                            spacing = numbers("Spacing", {1, 1, 1}), direction = numbers("Direction", {1, 0, 0, 0, 1, 0, 0, 0, 1});
  if (extent.size() != 6 || origin.size() != 3 || spacing.size() != 3 || direction.size() != 9) {
    return Status::InvalidArgument(
        fmt::format("{}: VTKHDF has {} numbers in WholeExtent, {} in Origin, {} in Spacing and {} in Direction, must "
                    "have 6, 3, 3 and 9",
                    file.path(), extent.size(), origin.size(), spacing.size(), direction.size()));
  }
  ImageDescription image{.format = "VTKHDF", .axes_from = "VTKHDF", .world = World::kScene, .origin = {origin[0], origin[1], origin[2]}};
  if (file.Has(kRoot + "/Steps")) {
    const Result<std::vector<double>> times = file.SmallDataset(kRoot + "/Steps/Values");
    const std::optional<EvenSteps> even = times.ok() ? EvenStepsOf(*times) : std::nullopt;
    image.axes.push_back({.name = "t", .step = even ? even->step : 1});
  }
  std::vector<std::uint64_t> sides;  // z, y, x
  for (std::size_t i = 3; i-- > 0;) {
    const double points = extent[2 * i + 1] - extent[2 * i] + 1, half = cells && points > 1 ? 0.5 : 0;
    image.axes.push_back({.name = std::string(1, "xyz"[i]),
                          .step = spacing[i],
                          .start = (extent[2 * i] + half) * spacing[i],
                          .direction = Vec3{direction[i], direction[3 + i], direction[6 + i]}});
    sides.push_back(std::uint64_t(std::clamp(cells ? std::max(1.0, points - 1) : points, 0.0, 1e9)));
  }
  const std::size_t first = image.axes.size() - 3, axes = dataset.size.size();
  if (axes == image.axes.size() + 1) image.axes.push_back({"c"});
  if (axes != image.axes.size() || !std::equal(sides.begin(), sides.end(), dataset.size.begin() + std::ptrdiff_t(first))) {
    return Status::InvalidArgument(file.Named(path) + fmt::format(" is of {}, but WholeExtent says {} along z, y and x{}",
                                                                  fmt::join(dataset.size, " x "), fmt::join(sides, " x "),
                                                                  cells ? " for cells" : ""));
  }
  if (cells) image.notes.emplace_back("samples of cells lie in their centres");
  return std::optional(std::move(image));
}

}  // namespace

ImageLayout VtkHdf() { return {Images, Describe}; }

}  // namespace slabstream
