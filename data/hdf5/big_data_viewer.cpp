// HDF5 files of BigDataViewer: tTTTTT/sSS/L/cells for time T, view setup S and level L, and sSS/resolutions, how many voxels of the view
// each level takes together along x, y and z. A setup is a channel here; in files it may also be an angle or a tile. The spacing is in an
// XML file beside it. Source: https://imagej.net/plugins/bdv/#about-the-bigdataviewer-data-format
#include <fmt/format.h>

#include <cmath>

#include "common/base/printable.h"
#include "common/text/parse_number.h"
#include "data/hdf5/hdf5_array.h"
#include "data/hdf5/hdf5_layouts.h"
#include "data/sources/view_setups.h"
#include "data/volume_io/chosen_channel.h"
#include "data/volume_io/raw_volume.h"

namespace slabstream {
namespace {

bool IsBigDataViewer(Hdf5File& file) {
  const Result<std::vector<std::string>> names = file.Names("/");
  if (!names.ok()) return false;
  const std::vector<std::string> setups = Numbered(*names, "s");
  return !setups.empty() && file.Has("/" + setups.front() + "/resolutions") && !Numbered(*names, "t").empty();
}

// Since 2023 a setup says what its samples are. Before, all were unsigned samples of 16 bits in signed ones, which is what Java has.
Result<SampleType> Meant(Hdf5File& file, const std::string& setup, SampleType stored) {
  const std::optional<std::string> text = file.Text("/" + setup, "dataType");
  if (!text) return stored == SampleType::kInt16 ? SampleType::kUint16 : stored;
  const std::optional<SampleType> meant = SampleTypeNamed(*text);
  const auto is_float = [](SampleType type) { return ToString(type).starts_with("float"); };
  if (meant && BytesPerSample(*meant) == BytesPerSample(stored) && is_float(*meant) == is_float(stored)) return *meant;
  return Status::InvalidArgument(
      fmt::format("{}: setup {} has the dataType '{}', but holds {}", file.path(), setup, Printable(*text), ToString(stored)));
}

// What users should know of a series whose numbers are not 0, 1, 2, ...
void NoteTime(const std::vector<std::string>& times, std::int64_t time, SourceInfo& info) {
  const std::string& name = times[std::size_t(time)];
  if (ParseNumber<std::int64_t>(name.substr(1)) != time) info.notes.push_back(fmt::format("time {} is {} of the file", time, name));
}

Result<Pyramid> Read(const std::shared_ptr<Hdf5File>& file, const ReadOptions& options, const SourceContext& context) {
  Pyramid pyramid{.info = {.format = "BigDataViewer HDF5", .files = {file->path()}}};
  const Result<std::vector<std::string>> names = file->Names("/");
  if (!names.ok()) return names.status();
  const std::vector<std::string> times = Numbered(*names, "t"), setups = Numbered(*names, "s");
  pyramid.info.times.count = int(times.size());
  const Result<std::int64_t> time = ChosenVolume(file->path(), pyramid.info.times.count, options);
  if (!time.ok()) return time.status();
  pyramid.info.time = int(*time);
  NoteTime(times, *time, pyramid.info);
  const Result<ViewSetupFile> xml = ReadViewSetupsBeside(file->path());
  if (!xml.ok()) return xml.status();
  pyramid.info.files.insert(pyramid.info.files.end(), xml->files.begin(), xml->files.end());
  for (const std::string& name : setups) pyramid.info.channels.push_back(xml->Of(name, "s").channel);
  const Result<int> channel = ChosenChannel(file->path(), pyramid.info.channels, options);
  if (!channel.ok()) return channel.status();
  pyramid.info.channel = *channel;
  const std::string& name = setups[std::size_t(*channel)];
  const ViewSetup setup = xml->Of(name, "s");
  const Vec3 spacing = setup.spacing.value_or(Vec3{1, 1, 1});
  if (setup.spacing) pyramid.orientation.unit = setup.unit;

  const std::string resolutions = "/" + name + "/resolutions";
  const Result<std::vector<double>> factors = file->SmallDataset(resolutions);
  if (!factors.ok()) return factors.status();
  if (factors->empty() || factors->size() % 3 != 0) {
    return Status::InvalidArgument(file->Named(resolutions) +
                                   fmt::format(" has {} numbers, must have three for each level", factors->size()));
  }
  for (std::size_t level = 0; level < factors->size() / 3; ++level) {
    const std::string path = fmt::format("/{}/{}/{}/cells", times[std::size_t(*time)], name, level);
    Result<std::shared_ptr<Hdf5Dataset>> dataset = file->Dataset(path);
    if (dataset.status().code() == StatusCode::kNotFound) {
      return Status::InvalidArgument(fmt::format("{}: setup {} has no samples of level {} at time {}: {}", file->path(), name, level, *time,
                                                 dataset.status().message()));
    }
    if (!dataset.ok()) return dataset.status();
    if ((*dataset)->size().size() != 3) {
      return Status::InvalidArgument(file->Named(path) + fmt::format(" has {} axes, must have 3", (*dataset)->size().size()));
    }
    const SampleType stored = (*dataset)->type();
    const Result<SampleType> meant = Meant(*file, name, stored);
    if (!meant.ok()) return meant.status();
    if (level == 0 && *meant != stored) {
      pyramid.info.notes.push_back(fmt::format("samples of {} are taken for {}", ToString(stored), ToString(*meant)));
    }
    const Result<std::shared_ptr<ChunkedArray>> array = MakeHdf5Array(*std::move(dataset), context, *meant);
    if (!array.ok()) return array.status();
    PyramidLevel each{.array = *array, .at = {0, 0, 0}};
    for (int axis = 0; axis < 3; ++axis) {
      const double factor = (*factors)[3 * level + std::size_t(axis)];
      if (!(factor > 0) || !std::isfinite(factor)) {
        return Status::InvalidArgument(file->Named(resolutions) + fmt::format(" holds {}, must hold numbers above 0", factor));
      }
      each.spacing[axis] = factor * spacing[axis];
      each.origin[axis] = 0.5 * (factor - 1) * spacing[axis];  // the mean of the voxels that it stands for
    }
    pyramid.levels.push_back(std::move(each));
  }
  return pyramid;
}

}  // namespace

Hdf5Layout BigDataViewerHdf5() { return {IsBigDataViewer, Read}; }

}  // namespace slabstream
