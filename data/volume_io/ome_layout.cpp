#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <map>
#include <set>
#include <utility>

#include "common/files/files.h"
#include "common/text/parse_number.h"
#include "data/volume_io/length_names.h"
#include "data/volume_io/ome_header.h"
#include "data/volume_io/page_layout.h"
#include "data/volume_io/tiff_file.h"

namespace slabstream {
namespace {

constexpr std::size_t kMostText = std::size_t{64} << 20;  // bytes of a file of metadata

// Names with folders come from writers on other machines; what lies elsewhere is not read.
std::string WithoutFolder(const std::string& name) { return name.substr(name.find_last_of("/\\") + 1); }

std::string Beside(const std::string& path, const std::string& name) {
  return (std::filesystem::path(path).parent_path() / WithoutFolder(name)).string();
}

// Which files the planes are in. Names count first, as for Bio-Formats; a name that is not there, or whose file has another UUID, stands
// for this file if that has the UUID or there is no other one: it has been renamed.
class FileSet {
 public:
  FileSet(const std::string& path, const OmeHeader& ome) : uuid_(ome.uuid), files_{path} {
    std::set<std::string> names;
    for (const OmeTiffData& data : ome.tiff_data) names.insert(data.file_name);
    only_one_ = names.size() <= 1;
  }

  std::size_t Find(const OmeTiffData& data) {
    if (data.file_name.empty() || WithoutFolder(data.file_name) == WithoutFolder(files_.front())) return 0;
    const auto [known, is_new] = numbers_.emplace(data.file_name, 0);
    if (!is_new) return known->second;
    const std::string path = Beside(files_.front(), data.file_name);
    std::error_code error;
    const bool is_there = std::filesystem::is_regular_file(path, error), is_mine = !uuid_.empty() && data.uuid == uuid_;
    if (is_there ? is_mine && !Holds(path, data.uuid) : is_mine || only_one_) return 0;
    known->second = files_.size();
    files_.push_back(path);
    return known->second;
  }

  std::vector<std::string> Take() { return std::move(files_); }

 private:
  static bool Holds(const std::string& path, const std::string& uuid) {
    const Result<std::string> description = DescriptionIn(path);
    return description.ok() && description->find(fmt::format("UUID=\"{}\"", uuid)) != std::string::npos;
  }

  const std::string uuid_;
  std::vector<std::string> files_;
  std::map<std::string, std::size_t> numbers_;  // of files by the names that planes give
  bool only_one_ = false;
};

// Where x or y is missing it is the other one, as for Bio-Formats. None: no size is stated.
void SetSpacing(const XmlTag& pixels, PageLayout& layout) {
  std::array<double, 3> sizes{};  // 0: not stated
  for (const Axis axis : kAxes) {
    const std::string key = std::string("PhysicalSize") + char(Letter(axis) - 'x' + 'X'), unit = pixels.Attribute(key + "Unit");
    const std::optional<double> number = ParseNumber<double>(pixels.Attribute(key));
    if (!number || !(*number > 0) || !std::isfinite(*number)) continue;
    const std::optional<double> micrometres = unit.empty() ? 1 : MicrometresIn(unit);
    if (!micrometres) {
      layout.notes.push_back(fmt::format("the unit of {}, '{}', is no length that is known: the size is left out", key, unit));
    } else {
      sizes[std::size_t(Number(axis))] = *number * *micrometres;
    }
  }
  auto& [x, y, z] = sizes;
  if (x == 0) x = y;
  if (y == 0) y = x;
  if (x == 0 && z == 0) return;
  if (x == 0) {
    layout.notes.emplace_back(
        "the file states no PhysicalSizeX and Y: pixels are as wide as slices are thick; --spacing states other sizes");
    x = y = z;
  }
  if (z == 0) {
    layout.notes.emplace_back(
        "the file states no PhysicalSizeZ: slices are as thick as pixels are wide; --spacing states another distance");
    z = x;
  }
  layout.spacing = Vec3{x, y, z};
  layout.unit = LengthUnit::kMicrometre;
}

// Some writers count planes from 1.
void CountFromZero(std::vector<PageRun>& runs, std::int64_t PageRun::*place, std::int64_t size) {
  const auto [least, greatest] = std::ranges::minmax(runs, {}, place);
  if (least.*place < 1 || greatest.*place < size) return;
  for (PageRun& run : runs) --(run.*place);
}

Result<std::size_t> ChosenImage(const std::string& path, const ReadOptions& options) {
  if (options.series.empty()) return std::size_t{0};
  const std::optional<std::size_t> number = ParseNumber<std::size_t>(options.series);
  if (number && *number < std::size_t(kMaxVolumes)) return *number;
  return Status::InvalidArgument(fmt::format("{}: series is '{}', must be the number of an image, from 0", path, options.series));
}

}  // namespace

Result<std::string> DescriptionIn(const std::string& path) {
  if (path.ends_with(".ome") || path.ends_with(".xml")) return ReadTextFile(path, kMostText);
  const Result<std::unique_ptr<TiffFile>> file = TiffFile::Open(path);
  if (!file.ok()) return file.status();
  return (*file)->Description();
}

Result<PageLayout> ReadOmeLayout(const std::string& path, const std::string& description, const ReadOptions& options) {
  const Result<std::size_t> image = ChosenImage(path, options);
  if (!image.ok()) return image.status();
  Result<OmeHeader> ome = ReadOmeHeader(path, description, *image);
  if (!ome.ok()) return ome.status();
  if (!ome->metadata_file.empty()) {
    const std::string elsewhere = Beside(path, ome->metadata_file);
    const Result<std::string> text = DescriptionIn(elsewhere);
    if (!text.ok()) return Status(text.status().code(), fmt::format("{}: its OME metadata: {}", path, text.status().message()));
    ome = ReadOmeHeader(elsewhere, *text, *image);
    if (!ome.ok()) return ome.status();
  }
  const auto wrong = [&](const std::string& why) { return Status::InvalidArgument(fmt::format("{}: {}", path, why)); };
  const std::size_t images = ome->images.size();
  if (*image >= images)
    return wrong(fmt::format("series is {}, its OME description has {} image{}", *image, images, images == 1 ? "" : "s"));

  PageLayout layout{.source = "OME",
                    .described = ome->channels,
                    .time_step = ParseNumber<double>(ome->pixels.Attribute("TimeIncrement")),
                    .time_unit = ome->pixels.Attribute("TimeIncrementUnit")};
  if (layout.time_unit.empty()) layout.time_unit = "s";
  constexpr std::pair<const char*, std::int64_t PageLayout::*> kSizes[] = {
      {"SizeZ", &PageLayout::slices}, {"SizeC", &PageLayout::channels}, {"SizeT", &PageLayout::times}};
  for (const auto& [key, size] : kSizes) {
    const std::string text = ome->pixels.Attribute(key);
    layout.*size = ParseNumber<std::int64_t>(text).value_or(0);
    if (layout.*size < 1 || layout.*size > kMaxVolumes) return wrong(fmt::format("{} is '{}', must be in [1, {}]", key, text, kMaxVolumes));
  }
  // "XYZCT": z runs fastest from page to page, then c, then t.
  const std::string order = ome->pixels.Attribute("DimensionOrder");
  layout.order = order.substr(std::min<std::size_t>(2, order.size()));
  std::string sorted = layout.order;
  std::ranges::sort(sorted);
  if (!order.starts_with("XY") || sorted != "CTZ") return wrong(fmt::format("DimensionOrder is '{}', must be such as XYZCT", order));

  FileSet files(path, *ome);
  for (const OmeTiffData& data : ome->tiff_data) {
    layout.runs.push_back({data.slice, data.channel, data.time, data.count, data.page, files.Find(data)});
  }
  layout.files = files.Take();
  // <TiffData/> alone says no more than none does.
  if (layout.runs.size() == 1 && layout.runs.front() == PageRun{}) layout.runs.clear();
  if (!layout.runs.empty()) {
    CountFromZero(layout.runs, &PageRun::slice, layout.slices);
    CountFromZero(layout.runs, &PageRun::channel, layout.channels);
    CountFromZero(layout.runs, &PageRun::time, layout.times);
  }
  SetSpacing(ome->pixels, layout);
  if (images > 1) {
    constexpr std::size_t kMostTold = 16;
    std::vector<std::string> told(ome->images.begin(), ome->images.begin() + std::ptrdiff_t(std::min(images, kMostTold)));
    for (std::size_t i = 0; i < told.size(); ++i) told[i] = fmt::format("{}{}{}", i, told[i].empty() ? "" : ": ", told[i]);
    layout.notes.push_back(fmt::format("this is image {} of {}, of which --series takes another one: {}{}", *image, images,
                                       fmt::join(told, ", "), images > kMostTold ? ", ..." : ""));
  }
  if (ome->modulo) layout.notes.emplace_back("an axis of the file stands for two (Modulo): it is not divided");
  return layout;
}

}  // namespace slabstream
