// One dataset of any HDF5 file: its last three axes are z, y and x, and one before them may be time.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "data/hdf5/hdf5_array.h"
#include "data/hdf5/hdf5_layouts.h"
#include "data/sources/space_axes.h"

namespace slabstream {
namespace {

constexpr std::size_t kSpaceAxes = 3;

// The datasets of a file, for messages: "'/a' of 100 x 20 x 30 uint16".
std::string Listed(const std::shared_ptr<Hdf5File>& file, const std::vector<std::string>& paths) {
  constexpr std::size_t kMost = 16, kMostBytes = 800;
  std::string list;
  for (std::size_t i = 0; i < paths.size(); ++i) {
    if (i == kMost || list.size() > kMostBytes) return list + fmt::format(" and {} more", paths.size() - i);
    const Result<std::shared_ptr<Hdf5Dataset>> dataset = file->Dataset(paths[i]);
    const std::string what =
        dataset.ok() ? fmt::format("of {} {}", fmt::join((*dataset)->size(), " x "), ToString((*dataset)->type())) : "which cannot be read";
    list += fmt::format("{}'{}' {}", list.empty() ? "" : ", ", paths[i], what);
  }
  return list;
}

Result<std::string> ChosenDataset(const std::shared_ptr<Hdf5File>& file, const ReadOptions& options) {
  if (!options.dataset.empty()) return options.dataset.starts_with('/') ? options.dataset : "/" + options.dataset;
  const std::vector<std::string> paths = file->Datasets(int(kSpaceAxes));
  if (paths.size() == 1) return paths[0];
  if (paths.empty())
    return Status::InvalidArgument(file->path() + ": has no dataset of three axes or more; --dataset PATH takes another one");
  return Status::InvalidArgument(
      fmt::format("{}: has {} datasets, of which --dataset takes one: {}", file->path(), paths.size(), Listed(file, paths)));
}

// ilastik and Fiji: micrometres along z, y and x.
std::optional<Vec3> SpacingOf(Hdf5File& file, const std::string& path) {
  const std::optional<std::vector<double>> numbers = file.Numbers(path, "element_size_um");
  if (!numbers || numbers->size() != kSpaceAxes) return std::nullopt;
  for (const double number : *numbers) {
    if (!(number > 0) || !std::isfinite(number)) return std::nullopt;
  }
  return Vec3{(*numbers)[2], (*numbers)[1], (*numbers)[0]};
}

Result<Pyramid> Read(const std::shared_ptr<Hdf5File>& file, const ReadOptions& options, const SourceContext& context) {
  const Result<std::string> path = ChosenDataset(file, options);
  if (!path.ok()) return path.status();
  Result<std::shared_ptr<Hdf5Dataset>> dataset = file->Dataset(*path);
  if (!dataset.ok()) return dataset.status();
  const Result<std::shared_ptr<ChunkedArray>> array = MakeHdf5Array(*std::move(dataset), context);
  if (!array.ok()) return array.status();
  const Result<SpaceAxes> space = LastAxesAreSpace(file->Named(*path), (*array)->shape().size, options);
  if (!space.ok()) return space.status();

  PyramidLevel level{.array = *array, .axes = space->axes, .at = space->at};
  Pyramid pyramid{.info = {.format = "HDF5", .times = space->times, .files = {file->path()}}};
  if (const std::optional<Vec3> spacing = SpacingOf(*file, *path)) {
    level.spacing = *spacing;
    pyramid.orientation.unit = LengthUnit::kMicrometre;
  }
  pyramid.levels.push_back(std::move(level));
  return pyramid;
}

}  // namespace

Hdf5Layout PlainHdf5() {
  return {[](Hdf5File&) { return true; }, Read};
}

}  // namespace slabstream
