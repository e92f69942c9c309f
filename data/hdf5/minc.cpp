// MINC. In version 2 minc-2.0/image/0/image has the samples, its attribute dimorder names its axes, and minc-2.0/dimensions says where they
// run; in version 1, which is classic netCDF, all of these are variables of the file. Integers stand for values between image-min and
// image-max, which may differ from slice to slice. Sources: the MINC 2.0 File Format Reference,
// https://en.wikibooks.org/wiki/MINC/Reference/MINC2.0_File_Format_Reference, and the MINC 1 Programmer's Guide.
#include <fmt/format.h>

#include <algorithm>
#include <sstream>
#include <tuple>

#include "common/base/log.h"
#include "data/hdf5/hdf5_image.h"

namespace slabstream {
namespace {

constexpr std::string_view kRoot = "/minc-2.0", kSamples = "/image";

bool IsVersion1(AttributedFile& file) { return file.Text(std::string(kSamples), "varid").value_or("") == "MINC standard variable"; }

Result<std::vector<std::string>> Images(AttributedFile& file) {
  const std::string path = fmt::format("{}/image/0{}", kRoot, kSamples);
  if (file.Has(path)) return std::vector<std::string>{path};
  return IsVersion1(file) ? std::vector<std::string>{std::string(kSamples)} : std::vector<std::string>{};
}

std::vector<std::string> Split(const std::string& names) {
  std::vector<std::string> parts;
  std::istringstream text(names);
  for (std::string part; std::getline(text, part, ',');) parts.push_back(part);
  return parts;
}

// Floats are data values.
Status DescribeScale(AttributedFile& file, const DatasetFacts& dataset, ImageDescription& image) {
  const std::string& path = dataset.path;
  const std::string group = path.substr(0, path.size() - kSamples.size());
  const std::optional<Limits> all = WholeNumbers(image.type.value_or(dataset.type));
  if (!all || dataset.enumeration || !file.Has(group + "/image-min") || !file.Has(group + "/image-max")) return Status::Ok();
  const Result<std::vector<double>> least = file.SmallDataset(group + "/image-min"), most = file.SmallDataset(group + "/image-max");
  if (!least.ok()) return least.status();
  if (!most.ok()) return most.status();
  ElementMeaning& meaning = image.meaning;
  std::uint64_t slices = 1;
  while (slices < least->size() && meaning.mapped_axes < dataset.size.size()) slices *= dataset.size[meaning.mapped_axes++];
  if (slices != least->size() || slices != most->size()) {
    return Status::InvalidArgument(file.Named(path) +
                                   fmt::format(" has {} numbers in image-min and {} in image-max, must have one for all of it or "
                                               "for each slice",
                                               least->size(), most->size()));
  }
  Limits valid = *all;
  if (const auto range = file.Numbers(path, "valid_range"); range && range->size() == 2) {
    std::tie(valid.least, valid.most) = std::minmax((*range)[0], (*range)[1]);
    if (!(valid.least < valid.most)) {
      return Status::InvalidArgument(file.Named(path) + fmt::format(" has the valid_range {} to {}", valid.least, valid.most));
    }
    meaning.clamp = true;
    if (valid.least > all->least) meaning.least = valid.least;
    if (valid.most < all->most) meaning.most = valid.most;
  }
  meaning.mappings.clear();
  for (std::size_t i = 0; i < slices; ++i) {
    const double scale = ((*most)[i] - (*least)[i]) / (valid.most - valid.least);
    meaning.mappings.push_back({scale, (*least)[i] - scale * valid.least});
  }
  image.notes.push_back(fmt::format("values are scaled from {:g} ... {:g} to image-min ... image-max{}", valid.least, valid.most,
                                    slices == 1 ? fmt::format(", {:g} ... {:g}", least->front(), most->front()) : " of each slice"));
  return Status::Ok();
}

Result<std::optional<ImageDescription>> Describe(AttributedFile& file, const DatasetFacts& dataset) {
  const std::string& path = dataset.path;
  const bool version1 = path == kSamples && IsVersion1(file);
  if (!version1 && (!path.starts_with(kRoot) || !path.ends_with(kSamples))) return std::optional<ImageDescription>();
  ImageDescription image{.format = "MINC 2", .axes_from = "dimorder", .world = World::kPatient, .labels = dataset.enumeration};
  const std::string dimensions = version1 ? "/" : fmt::format("{}/dimensions/", kRoot);
  std::vector<std::string> order = Split(file.Text(path, "dimorder").value_or(""));
  if (version1) {
    image.format = "MINC 1";
    image.axes_from = "its dimensions";
    order = file.DimensionScales(path);
    for (std::string& name : order) name.erase(0, dimensions.size());
    const std::string sign = file.Text(path, "signtype").value_or(dataset.type == SampleType::kInt8 ? "unsigned" : "signed__");
    image.type = WithSign(dataset.type, sign != "unsigned");
  }
  if (order.size() != dataset.size.size()) {
    return Status::InvalidArgument(
        file.Named(path) + fmt::format(" has {} axes, of which its attribute dimorder names {}", dataset.size.size(), order.size()));
  }
  for (const std::string& name : order) {
    ImageAxis axis{.name = name == "vector_dimension" ? "c" : name};
    if (name == "xspace" || name == "yspace" || name == "zspace") {
      const std::string dimension = dimensions + name;
      if (file.Text(dimension, "spacing").value_or("").starts_with("irregular")) {
        LogWarning(fmt::format("{}: its voxels along {} are not evenly spaced; they are shown as if they were", file.path(), name));
      }
      axis = {.name = name.substr(0, 1), .unit = LengthUnit::kMillimetre};
      if (const auto step = file.Numbers(dimension, "step")) axis.step = step->front();
      if (const auto start = file.Numbers(dimension, "start")) axis.start = start->front();
      const auto cosines = file.Numbers(dimension, "direction_cosines");
      if (cosines && cosines->size() == 3) axis.direction = Vec3{(*cosines)[0], (*cosines)[1], (*cosines)[2]};
    }
    if (name == "time") {
      if (const auto step = file.Numbers(dimensions + "time", "step")) axis.step = step->front();
      axis.time_unit = "s";
    }
    image.axes.push_back(std::move(axis));
  }
  if (Status status = DescribeScale(file, dataset, image); !status.ok()) return status;
  return std::optional(std::move(image));
}

}  // namespace

ImageLayout Minc() { return {Images, Describe}; }

}  // namespace slabstream
