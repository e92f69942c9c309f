// Imaris 5.5 files (.ims): DataSet/ResolutionLevel R/TimePoint T/Channel C/Data. Datasets are padded to whole chunks; attributes say how
// large the image is. Source: https://imaris.oxinst.com/learning/view/article/imaris-5-5-file-format-description
#include <fmt/format.h>

#include <chrono>
#include <cmath>
#include <limits>
#include <sstream>

#include "common/base/log.h"
#include "common/text/parse_number.h"
#include "data/hdf5/hdf5_array.h"
#include "data/hdf5/hdf5_layouts.h"
#include "data/volume_io/chosen_channel.h"
#include "data/volume_io/length_names.h"
#include "data/volume_io/raw_volume.h"
#include "data/volume_io/stated_field.h"

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

// "0.000 255.000"; NaN where a word is no number.
std::vector<double> NumbersIn(const std::string& text) {
  std::vector<double> numbers;
  std::istringstream words(text);
  for (std::string word; words >> word;) numbers.push_back(ParseNumber<double>(word).value_or(std::numeric_limits<double>::quiet_NaN()));
  return numbers;
}

FieldInfo ChannelOf(Hdf5File& file, int number) {
  const auto text = [&](const char* attribute) {
    return file.Text(fmt::format("/DataSetInfo/Channel {}", number), attribute).value_or("");
  };
  FieldInfo channel{.name = text("Name").substr(0, kMostNameBytes)};
  const std::vector<double> window = NumbersIn(text("ColorRange")), color = NumbersIn(text("Color"));
  if (window.size() == 2) channel.window = StatedWindow(window[0], window[1]);
  // A channel may have a table of colours instead.
  if (color.size() == 3 && text("ColorMode") != "TableColor") channel.color = StatedColor(color[0], color[1], color[2]);
  return channel;
}

// Seconds since some day of "2008-01-31 23:59:59.250"; NaN: it is none.
double SecondsOf(const std::string& stamp) {
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  if (stamp.size() < 19 || stamp.find_first_not_of("0123456789-: .") != std::string::npos) return kNone;
  const std::string_view text = stamp;
  const auto whole = [&](std::size_t begin, std::size_t size) { return ParseNumber<unsigned>(text.substr(begin, size)).value_or(9999); };
  const std::chrono::year_month_day day{std::chrono::year(int(whole(0, 4))), std::chrono::month(whole(5, 2)),
                                        std::chrono::day(whole(8, 2))};
  const double of_minute = ParseNumber<double>(text.substr(17)).value_or(kNone);
  if (!day.ok() || whole(11, 2) > 23 || whole(14, 2) > 59) return kNone;
  const auto days = std::chrono::sys_days(day).time_since_epoch().count();
  return 86400.0 * double(days) + 3600 * whole(11, 2) + 60 * whole(14, 2) + of_minute;
}

TimeAxis TimesOf(Hdf5File& file, int count) {
  std::vector<double> seconds;
  for (int i = 1; i <= count && (seconds.empty() || !std::isnan(seconds.back())); ++i) {
    seconds.push_back(SecondsOf(file.Text("/DataSetInfo/TimeInfo", fmt::format("TimePoint{}", i)).value_or("")));
  }
  return StatedTimes(count, seconds, "s");
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
  pyramid.info.times = TimesOf(*file, CountNumbered(*times, "TimePoint "));
  const Result<std::int64_t> time = ChosenVolume(file->path(), pyramid.info.times.count, options);
  if (!time.ok()) return time.status();
  pyramid.info.time = int(*time);

  const Result<std::vector<std::string>> channels = file->Names(fmt::format("/DataSet/ResolutionLevel 0/TimePoint {}", *time));
  if (!channels.ok()) return channels.status();
  const int channel_count = CountNumbered(*channels, "Channel "), level_count = CountNumbered(*levels, "ResolutionLevel ");
  for (int i = 0; i < channel_count; ++i) pyramid.info.channels.push_back(ChannelOf(*file, i));
  if (pyramid.info.channels.empty()) return Status::InvalidArgument(file->path() + ": not an Imaris volume: it has no channel");
  const Result<int> channel = ChosenChannel(file->path(), pyramid.info.channels, options);
  if (!channel.ok()) return channel.status();
  pyramid.info.channel = *channel;

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
