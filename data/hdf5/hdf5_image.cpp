#include "data/hdf5/hdf5_image.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <sstream>

#include "common/base/log.h"
#include "common/base/printable.h"
#include "data/sources/axis_choice.h"
#include "data/volume_io/even_steps.h"
#include "data/volume_io/formats.h"
#include "data/volume_io/length_names.h"
#include "data/volume_io/raw_volume.h"
#include "data/volume_io/stated_field.h"
#include "data/volume_io/world_placement.h"

namespace slabstream {
namespace {

const std::array<ImageLayout, 5>& Layouts() {
  static const std::array<ImageLayout, 5> layouts = {ItkImage(), Minc(), VtkHdf(), Nexus(), OpenPmdMesh()};
  return layouts;
}

// Datasets, for messages: "'/a' of 100 x 20 x 30 uint16".
std::string Listed(AttributedFile& file, const std::vector<std::string>& paths) {
  constexpr std::size_t kMost = 16, kMostBytes = 800;
  std::string list;
  for (std::size_t i = 0; i < paths.size(); ++i) {
    if (i == kMost || list.size() > kMostBytes) return list + fmt::format(" and {} more", paths.size() - i);
    const Result<DatasetFacts> dataset = file.Describe(paths[i]);
    const std::string what =
        dataset.ok() ? fmt::format("of {} {}", fmt::join(dataset->size, " x "), ToString(dataset->type)) : "which cannot be read";
    list += fmt::format("{}'{}' {}", list.empty() ? "" : ", ", Printable(paths[i]), what);
  }
  return list;
}

// What datasets name, by the conventions of CF, as coordinates of several axes or as bounds of their cells.
std::set<std::string> NamedByOthers(AttributedFile& file) {
  std::set<std::string> named;
  for (const std::string& path : file.Datasets(1).paths) {
    for (const std::string_view attribute : kNamingAttributes) {
      std::istringstream names(file.Text(path, std::string(attribute)).value_or(""));
      for (std::string name; names >> name;) named.insert(path.substr(0, path.rfind('/') + 1) + name);
    }
  }
  return named;
}

// Datasets of three axes or more, else of two: slices. Those that others name count only if there are no others.
Result<std::vector<std::string>> PlainImages(AttributedFile& file) {
  AttributedFile::Found found = file.Datasets(3);
  const std::set<std::string> named = NamedByOthers(file);
  const auto is_named = [&](const std::string& path) { return named.contains(path); };
  if (!std::ranges::all_of(found.paths, is_named)) {
    std::erase_if(found.paths, is_named);
    return std::move(found.paths);
  }
  for (const std::string& path : found.closed) {
    if (const Status status = file.Describe(path).status(); !status.ok()) return status;
  }
  std::vector<std::string> slices = file.Datasets(2).paths;
  if (slices.empty()) return Status::InvalidArgument(file.path() + ": has no dataset of two axes or more");
  if (!std::ranges::all_of(slices, is_named)) std::erase_if(slices, is_named);
  return slices;
}

Result<std::string> ChosenDataset(AttributedFile& file, const ReadOptions& options) {
  if (!options.dataset.empty()) return options.dataset.starts_with('/') ? options.dataset : "/" + options.dataset;
  // Arrays of grids are no images.
  const bool cgns = file.Has("/CGNSLibraryVersion"), exodus = file.Numbers("/", "floating_point_word_size").has_value();
  const std::string_view why = cgns ? kWhyNotCgns : exodus ? kWhyNotExodus : WhyUnread(file.path());
  if (!why.empty()) return Status::InvalidArgument(fmt::format("{}: {}", file.path(), why));
  std::vector<std::string> paths;
  for (const ImageLayout& layout : Layouts()) {
    Result<std::vector<std::string>> images = layout.images(file);
    if (!images.ok()) return images.status();
    paths = *std::move(images);
    if (!paths.empty()) break;
  }
  if (paths.empty()) {
    Result<std::vector<std::string>> images = PlainImages(file);
    if (!images.ok()) return images.status();
    paths = *std::move(images);
  }
  if (paths.size() == 1) return paths[0];
  return Status::InvalidArgument(
      fmt::format("{}: has {} datasets, of which --dataset takes one: {}", file.path(), paths.size(), Listed(file, paths)));
}

Result<ImageDescription> Described(AttributedFile& file, const DatasetFacts& dataset) {
  for (const ImageLayout& layout : Layouts()) {
    Result<std::optional<ImageDescription>> image = layout.describe(file, dataset);
    if (!image.ok()) return image.status();
    if (image->has_value()) return **std::move(image);
  }
  return DescribeByAttributes(file, dataset);
}

// The volume of the chosen axes as RawHeader has it: its stored axes are the dataset's x, y and z.
Result<RawHeader> HeaderOf(const std::string& named, const ImageDescription& image, const ChosenAxes& choice,
                           const std::vector<std::uint64_t>& sizes) {
  RawHeader header{.size = {1, 1, 1}, .world = image.world, .origin = image.origin, .matrix = "the directions of its axes"};
  std::array<const ImageAxis*, 3> axes{};
  for (std::size_t i = 0; i < 3; ++i) {
    if (choice.axes[i] < 0) continue;
    const auto number = std::size_t(choice.axes[i]);
    axes[i] = &image.axes[number];
    header.size[int(i)] = std::int32_t(std::min(sizes[number], std::uint64_t{kMaxVolumeSide} + 1));
  }
  // Lengths have a unit if all of them have one: that of x.
  const bool have_units = std::ranges::all_of(axes, [](const ImageAxis* axis) { return axis == nullptr || axis->unit; });
  if (have_units) header.unit = axes[0]->unit;
  for (std::size_t i = 0; i < 3; ++i) {
    if (axes[i] == nullptr) continue;
    const double factor = have_units ? MetresIn(*axes[i]->unit) / MetresIn(*header.unit) : 1;
    const Vec3 direction = axes[i]->direction.value_or(Normalized(header.steps[i]));
    header.steps[i] = factor * axes[i]->step * direction;
    header.origin = header.origin + factor * axes[i]->start * direction;
    if (axes[i]->uneven.empty()) continue;
    std::vector<double> coordinates = axes[i]->uneven;
    for (double& coordinate : coordinates) coordinate *= factor;
    Result<UnevenAxis> uneven = UnevenAxisOf(named + ": coordinates " + axes[i]->uneven_named, coordinates, ValuesAt::kPoints);
    if (!uneven.ok()) return uneven.status();
    header.uneven[i] = *std::move(uneven);
  }
  return header;
}

// What becomes of axes whose coordinates are not even. Labels, and coordinates that go up and down, have no rectilinear grid.
void PlaceUneven(const std::string& path, const ReadOptions& options, ImageDescription& image) {
  for (ImageAxis& axis : image.axes) {
    if (axis.uneven.empty()) continue;
    const bool values = !image.labels && !options.labels;
    if (options.resample || (values && UnevenAxisOf(axis.uneven_named, axis.uneven, ValuesAt::kPoints).ok())) {
      image.world = World::kScene;
      axis.start = axis.uneven.front();
      axis.step = (axis.uneven.back() - axis.start) / double(axis.uneven.size() - 1);
      image.notes.push_back(fmt::format("coordinates {} place its axis", axis.uneven_named));
      continue;
    }
    image.notes.push_back(fmt::format("coordinates {} are not evenly spaced: {}; {} along it are shown at a distance of 1",
                                      axis.uneven_named, WhyUneven(axis.uneven), values ? "voxels" : "labels"));
    LogWarning(fmt::format("{}: {}", path, image.notes.back()));
    axis.uneven.clear();
    axis.unit.reset();
  }
}

std::string NoteOfAxes(const ImageDescription& image, const std::vector<AxisKind>& kinds) {
  std::vector<std::string_view> names;
  for (const AxisKind kind : kinds) names.push_back(NameOf(kind));
  return fmt::format("axes of the dataset: {} (by {})", fmt::join(names, ", "), image.axes_from.empty() ? "their order" : image.axes_from);
}

}  // namespace

Result<Pyramid> ReadImage(AttributedFile& file, const ReadOptions& options, const SourceContext& context) {
  const Result<std::string> path = ChosenDataset(file, options);
  if (!path.ok()) return path.status();
  const Result<DatasetFacts> dataset = file.Describe(*path);
  if (!dataset.ok()) return dataset.status();
  Result<ImageDescription> image = Described(file, *dataset);
  if (!image.ok()) return image.status();
  PlaceUneven(file.path(), options, *image);
  const std::string named = file.Named(*path);
  std::vector<std::string> names;
  for (const ImageAxis& axis : image->axes) names.push_back(axis.name);
  const Result<std::vector<AxisKind>> kinds = KindsOfPlainAxes(named, names, options);
  if (!kinds.ok()) return kinds.status();
  const std::vector<std::uint64_t>& sizes = dataset->size;
  const Result<ChosenAxes> choice = ChooseAxes(named, *kinds, sizes, options);
  if (!choice.ok()) return choice.status();
  if (choice->axes[0] < 0 || choice->axes[1] < 0) return Status::InvalidArgument(named + " has no axes x and y");
  const Result<RawHeader> header = HeaderOf(named, *image, *choice, sizes);
  if (!header.ok()) return header.status();
  const Result<WorldPlacement> placed = PlaceInWorld(*header, named);
  if (!placed.ok()) return placed.status();
  if (placed->slant)
    return Status::InvalidArgument(named + " has axes that are not at right angles, which is not supported in HDF5 and netCDF files");

  Result<std::shared_ptr<ChunkedArray>> array = file.Array(*path, context, image->type);
  if (!array.ok()) return array.status();
  Pyramid pyramid{.orientation = placed->geometry.orientation, .rescale = image->meaning.mappings.front()};
  if (!image->meaning.linear()) {
    array = MakeMappedArray(*std::move(array), std::move(image->meaning));
    pyramid.rescale = {};
  }
  PyramidLevel level{.array = *array,
                     .mirrored = placed->turn.flipped,
                     .at = choice->at,
                     .time_axis = choice->time_axis,
                     .channel_axis = choice->channel_axis,
                     .spacing = placed->geometry.spacing,
                     .origin = placed->geometry.orientation.origin};
  for (std::size_t i = 0; i < 3; ++i) level.axes[i] = choice->axes[std::size_t(placed->turn.from[i])];
  pyramid.levels.push_back(std::move(level));
  pyramid.info = {.format = image->format,
                  .file_type = std::string(ToString(dataset->type)),
                  .labels = image->labels,
                  .notes = std::move(image->notes),
                  .files = {file.path()},
                  .uneven = placed->uneven};
  choice->Describe(pyramid.info);
  if (const auto time = std::ranges::find(*kinds, AxisKind::kTime); time != kinds->end()) {
    const ImageAxis& axis = image->axes[std::size_t(time - kinds->begin())];
    pyramid.info.times = StatedTimes(choice->times, axis.step, axis.time_unit);
  }
  pyramid.info.notes.insert(pyramid.info.notes.begin(), NoteOfAxes(*image, *kinds));
  return pyramid;
}

}  // namespace slabstream
