// Imaris 5.5 files (.ims): DataSet/ResolutionLevel R/TimePoint T/Channel C/Data. Datasets are padded to whole chunks; attributes say how
// large the image is. Source: https://imaris.oxinst.com/learning/view/article/imaris-5-5-file-format-description
#include <fmt/format.h>

#include <cmath>

#include "common/base/log.h"
#include "common/text/parse_number.h"
#include "data/hdf5/hdf5_array.h"
#include "data/hdf5/hdf5_layouts.h"
#include "data/volume_io/chosen_channel.h"
#include "data/volume_io/length_names.h"
#include "data/volume_io/raw_volume.h"

namespace slabstream {
namespace {

constexpr std::size_t kMostNameBytes = 256;  // of a channel
constexpr const char* kImage = "/DataSetInfo/Image";

bool IsImaris(Hdf5File& file) { return file.Has("/DataSetInfo") && file.Has("/DataSet/ResolutionLevel 0"); }

std::optional<double> Number(Hdf5File& file, const std::string& object, const std::string& attribute) {
  const std::optional<std::string> text = file.Text(object, attribute);
  std::optional<double> number = text ? ParseNumber<double>(*text) : std::nullopt;
  if (const auto numbers = file.Numbers(object, attribute); numbers && numbers->size() == 1) number = numbers->front();
  return number && std::isfinite(*number) ? number : std::nullopt;
}

// Where the image lies, if the file says so: from the outer border of its first voxel to that of its last one.
struct Extent {
  Vec3 begin, end;
};
std::optional<Extent> ExtentOf(Hdf5File& file) {
  Extent extent;
  for (int axis = 0; axis < 3; ++axis) {
    const auto begin = Number(file, kImage, fmt::format("ExtMin{}", axis)), end = Number(file, kImage, fmt::format("ExtMax{}", axis));
    if (!begin || !end || !(*end > *begin)) return std::nullopt;
    extent.begin[axis] = *begin;
    extent.end[axis] = *end;
  }
  return extent;
}

// "0.000 255.000"
std::optional<ValueRange> WindowOf(Hdf5File& file, int channel) {
  const std::string text = file.Text(fmt::format("/DataSetInfo/Channel {}", channel), "ColorRange").value_or("");
  const std::size_t space = text.find(' ');
  if (space == std::string::npos) return std::nullopt;
  const auto min = ParseNumber<float>(text.substr(0, space)), max = ParseNumber<float>(text.substr(space + 1));
  return min && max && *min < *max && std::isfinite(*min) && std::isfinite(*max) ? std::optional(ValueRange{*min, *max}) : std::nullopt;
}

// z, y, x. Empty: the file does not say.
std::vector<std::uint64_t> ImageSize(Hdf5File& file, const std::string& group, int level) {
  std::vector<std::uint64_t> size;
  for (const char axis : {'Z', 'Y', 'X'}) {
    std::optional<double> along = Number(file, group, fmt::format("ImageSize{}", axis));
    if (!along && level == 0) along = Number(file, kImage, std::string(1, axis));
    if (!along || !(*along >= 1) || *along > kMaxVolumeSide) return {};
    size.push_back(std::uint64_t(*along));
  }
  return size;
}

Result<Pyramid> Read(const std::shared_ptr<Hdf5File>& file, const ReadOptions& options, const SourceContext& context) {
  Pyramid pyramid{.info = {.format = "Imaris", .files = {file->path()}}};
  const Result<std::vector<std::string>> levels = file->Names("/DataSet");
  if (!levels.ok()) return levels.status();
  const Result<std::vector<std::string>> times = file->Names("/DataSet/ResolutionLevel 0");
  if (!times.ok()) return times.status();
  pyramid.info.times = CountNumbered(*times, "TimePoint ");
  const Result<std::int64_t> time = ChosenVolume(file->path(), pyramid.info.times, options);
  if (!time.ok()) return time.status();
  pyramid.info.time = int(*time);

  const Result<std::vector<std::string>> channels = file->Names(fmt::format("/DataSet/ResolutionLevel 0/TimePoint {}", *time));
  if (!channels.ok()) return channels.status();
  const int channel_count = CountNumbered(*channels, "Channel "), level_count = CountNumbered(*levels, "ResolutionLevel ");
  for (int i = 0; i < channel_count; ++i) {
    pyramid.info.channels.push_back(file->Text(fmt::format("/DataSetInfo/Channel {}", i), "Name").value_or("").substr(0, kMostNameBytes));
  }
  if (pyramid.info.channels.empty()) return Status::InvalidArgument(file->path() + ": not an Imaris volume: it has no channel");
  const Result<int> channel = ChosenChannel(file->path(), pyramid.info.channels, options);
  if (!channel.ok()) return channel.status();
  pyramid.info.channel = *channel;
  pyramid.info.window = WindowOf(*file, *channel);

  const std::optional<Extent> extent = ExtentOf(*file);
  if (extent) {
    pyramid.orientation.world = World::kScene;
    pyramid.orientation.unit = LengthUnitNamed(file->Text(kImage, "Unit").value_or(""));
  }
  Vec3 finest;  // voxels of level 0
  for (int level = 0; level < level_count; ++level) {
    const std::string group = fmt::format("/DataSet/ResolutionLevel {}/TimePoint {}/Channel {}", level, *time, *channel);
    Result<std::shared_ptr<Hdf5Dataset>> dataset = file->Dataset(group + "/Data");
    if (!dataset.ok()) return dataset.status();
    const std::vector<std::uint64_t> stated = ImageSize(*file, group, level);
    const bool another_type = level > 0 && (*dataset)->type() != pyramid.levels.front().array->shape().type;
    if (level > 0 && (another_type || stated.empty())) {
      LogWarning(fmt::format("{}: levels from {} on are left out: {}", file->path(), level,
                             another_type ? fmt::format("its samples are {}, those before {}", ToString((*dataset)->type()),
                                                        ToString(pyramid.levels.front().array->shape().type))
                                          : "it does not say how large its image is"));
      break;
    }
    const Result<std::shared_ptr<ChunkedArray>> array = MakeHdf5Array(*std::move(dataset), context, {}, stated);
    if (!array.ok()) return array.status();
    const std::vector<std::uint64_t>& size = (*array)->shape().size;
    if (size.size() != 3)
      return Status::InvalidArgument(file->Named(group + "/Data") + fmt::format(" has {} axes, must have 3", size.size()));
    PyramidLevel each{.array = *array, .at = {0, 0, 0}};
    for (int axis = 0; axis < 3; ++axis) {
      const double voxels = double(size[std::size_t(2 - axis)]);
      if (level == 0) finest[axis] = voxels;
      const double begin = extent ? extent->begin[axis] : -0.5, length = extent ? extent->end[axis] - begin : finest[axis];
      each.spacing[axis] = length / voxels;
      each.origin[axis] = begin + 0.5 * each.spacing[axis];
    }
    pyramid.levels.push_back(std::move(each));
  }
  return pyramid;
}

}  // namespace

Hdf5Layout Imaris() { return {IsImaris, Read}; }

}  // namespace slabstream
