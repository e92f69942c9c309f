// Images of ITK: ITKImage/0/VoxelData beside Spacing, Origin and Directions, whose row i is the direction of axis i. Axes of the dataset
// run from the last one of the image to x; components of a voxel lie behind them. Source: itkHDF5ImageIO.cxx
#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "data/hdf5/hdf5_image.h"
#include "data/volume_io/raw_volume.h"

namespace slabstream {
namespace {

constexpr std::string_view kImages = "/ITKImage/", kSamples = "/VoxelData";

Result<std::vector<std::string>> Images(AttributedFile& file) {
  std::vector<std::string> images;
  const Result<std::vector<std::string>> names = file.Names("/ITKImage");
  if (!names.ok()) return names.status();
  for (const std::string& name : *names) images.push_back(fmt::format("{}{}{}", kImages, name, kSamples));
  return images;
}

Result<std::optional<ImageDescription>> Describe(AttributedFile& file, const DatasetFacts& dataset) {
  const std::string& path = dataset.path;
  if (!path.starts_with(kImages) || !path.ends_with(kSamples)) return std::optional<ImageDescription>();
  const std::string group = path.substr(0, path.size() - kSamples.size());
  const Result<std::vector<double>> spacing = file.SmallDataset(group + "/Spacing"), origin = file.SmallDataset(group + "/Origin"),
                                    directions = file.SmallDataset(group + "/Directions");
  for (const auto* numbers : {&spacing, &origin, &directions}) {
    if (!numbers->ok()) return numbers->status();
  }
  const std::size_t sides = spacing->size(), axes = dataset.size.size();
  const bool components = axes == sides + 1;
  if ((axes != sides && !components) || origin->size() != sides || directions->size() != sides * sides) {
    return Status::InvalidArgument(file.Named(path) +
                                   fmt::format(" has {} axes, {} spacings, {} coordinates of the origin and {} of directions", axes, sides,
                                               origin->size(), directions->size()));
  }
  ImageDescription image{.format = "ITK HDF5", .axes_from = "ITK", .world = World::kPatient};
  constexpr std::array<std::string_view, 4> kNames = {"x", "y", "z", "t"};
  const std::size_t placed = std::min<std::size_t>(3, sides);
  for (std::size_t i = sides; i-- > 0;) {
    ImageAxis axis{.name = std::string(i < kNames.size() ? kNames[i] : ""), .step = (*spacing)[i], .unit = LengthUnit::kMillimetre};
    Vec3 direction;
    for (std::size_t row = 0; row < placed; ++row) direction[int(row)] = (*directions)[i * sides + row];
    axis.direction = kRasFromLps * direction;
    image.axes.push_back(std::move(axis));
    if (i < placed) image.origin[int(i)] = kRasFromLps[int(i)] * (*origin)[i];
  }
  if (components) image.axes.push_back({"c"});
  return std::optional(std::move(image));
}

}  // namespace

ImageLayout ItkImage() { return {Images, Describe}; }

}  // namespace slabstream
