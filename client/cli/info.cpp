#include <fmt/chrono.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <iostream>
#include <map>
#include <memory>
#include <numbers>
#include <numeric>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "client/cli/commands.h"
#include "client/cli/dicom_listing.h"
#include "client/cli/input_volume.h"
#include "client/cli/progress.h"
#include "client/pictures/picture_header.h"
#include "client/report/volume_text.h"
#include "client/request/json_value.h"
#include "common/base/printable.h"
#include "common/json/json.h"
#include "common/planning/brick_visibility.h"
#include "common/planning/resolved_request.h"
#include "common/view/picture_geometry.h"
#include "common/volume/summary.h"
#include "data/catalogue/catalogue.h"
#include "data/catalogue/shape_data.h"
#include "data/layers/layer_files.h"
#include "data/open/read_volume.h"
#include "data/stores/object_cache.h"
#include "data/survey/brick_index.h"
#include "data/survey/index_file.h"
#include "data/volume_io/mesh_reader.h"

namespace slabstream {
namespace {

// A volume and its statistics, without its voxels.
struct VolumeFacts {
  SourceInfo file;
  std::shared_ptr<const VolumeSummary> summary;  // of the whole volume, or what a survey found
  std::optional<OpenedSource> parts = {};        // none: it was read as a whole
};

// Of a source that can have an index.
struct IndexFacts {
  std::string path;
  std::optional<IndexFile::Facts> file;  // none: it has none
  bool usable = false;                   // else it is of other files, or damaged; the log says so
  double read = 0;                       // share of the bricks that it knows
  double may_show = 0;                   // share of the bricks of level 0 that can be visible
  std::size_t bricks = 0;                // of level 0
};

std::optional<IndexFacts> IndexFactsOf(const std::string& source, const OpenedSource& opened, const TransferFunction& transfer) {
  const Result<IndexFile> file = IndexFileOf(source);
  if (!file.ok()) return std::nullopt;
  IndexFacts facts{.path = file->path(), .file = file->facts(), .usable = opened.index != nullptr};
  if (!facts.usable) return facts;
  facts.read = ShareRead(*opened.index);
  const VolumeSummary finest = UnreadSummary(opened.source->info().levels.front().description, *opened.survey.summary);
  const BrickRangeList bricks = DataRanges(opened.index->levels.front(), finest.description);
  const BrickVisibility visibility(finest, bricks, Classify(transfer, finest.description, finest.range));
  facts.bricks = bricks.size();
  std::size_t shown = 0;
  for (std::size_t i = 0; i < bricks.size(); ++i) shown += visibility.AnyVisible(i) ? 1 : 0;
  facts.may_show = double(shown) / double(facts.bricks);
  return facts;
}

std::string TimeText(std::chrono::system_clock::time_point time) {
  return fmt::format("{:%Y-%m-%dT%H:%M:%SZ}", fmt::gmtime(std::chrono::system_clock::to_time_t(time)));
}

std::string IndexText(const std::optional<IndexFacts>& index, const std::string& transfer) {
  if (!index) return "";
  if (!index->file) return "index        none; `slabstream index` makes one, and pictures then read less\n";
  const std::string which =
      fmt::format("index        {}, {:.1f} KiB, of {}", index->path, double(index->file->bytes) / 1024, TimeText(index->file->written));
  if (!index->usable) return which + ": not used\n";
  std::string text = fmt::format("{}\n  {:.3g} % of {} bricks of level 0 can be visible under transfer function '{}'\n", which,
                                 100 * index->may_show, index->bricks, transfer);
  if (index->read < 1) text += fmt::format("  it knows {:.3g} % of all bricks; `slabstream index` reads the others\n", 100 * index->read);
  return text;
}

Json IndexJson(const std::optional<IndexFacts>& index) {
  if (!index || !index->file) return nullptr;
  Json json = {
      {"path", index->path}, {"bytes", index->file->bytes}, {"written", TimeText(index->file->written)}, {"usable", index->usable}};
  if (index->usable) {
    json["read"] = index->read;
    json["visible"] = index->may_show;
  }
  return json;
}

// Of a volume with several levels, or a large one, what a survey of it tells; of any other one, what all voxels tell.
Result<VolumeFacts> FactsOf(const std::string& source) {
  ProgressBar bar(::isatty(STDERR_FILENO) == 1, 1);
  const auto tell = [&](const ReadShare& share) { bar.Show(0.01 * share.percent, Describe(share, source)); };
  DataSource file(source, "");
  file.is_field = true;
  Result<ReadableSource> read = ReadSource(file, std::uint64_t(kExactBytes), tell);
  if (!read.ok()) return read.status();
  if (auto* const opened = std::get_if<OpenedSource>(&*read)) {
    SourceInfo info = opened->source->info();
    if (opened->survey.summary->labels == nullptr && MayBeRounded(info.exact.type)) info.notes.push_back(RoundingText(info.exact.type));
    return VolumeFacts{std::move(info), opened->survey.summary, std::move(*opened)};
  }
  const LoadedSource& loaded = std::get<LoadedSource>(*read);
  return VolumeFacts{loaded.file, std::make_shared<const VolumeSummary>(OverTimes(loaded.Summary(), loaded.other_times))};
}

std::uint64_t CountedVoxels(const VolumeSummary& summary) {
  return std::accumulate(summary.histogram.begin(), summary.histogram.end(), std::uint64_t(summary.non_finite));
}

std::uint64_t VoxelsOf(const VolumeSummary& summary) { return CountIn(summary.description.geometry.size); }

// Of the voxels that were counted, which may be a sample.
double OccupancyOf(const VolumeSummary& summary, const TransferFunction& transfer) {
  if (CountedVoxels(summary) == 0) return 0;  // labels of more than 16 bits
  return EstimateOccupancy(summary, transfer) * (double(VoxelsOf(summary)) / double(CountedVoxels(summary)));
}

// Where the statistics come from; "": from all voxels.
std::string OfWhichVoxels(const VolumeFacts& facts) {
  std::string which;
  if (facts.parts) {
    const auto& [level, sample, summary] = facts.parts->survey;
    if (sample) {
      which = fmt::format(" of a sample of level {}", level);
    } else if (level > 0) {
      which = fmt::format(" of level {}", level);
    }
  }
  if (facts.summary->times > 1) which += fmt::format(" of {} of {} times", facts.summary->times, facts.file.times.count);
  return which;
}

std::string TransferName(const TransferChoice& transfer) {
  const auto* preset = std::get_if<std::string>(&transfer.choice);
  return preset != nullptr ? *preset : "file";
}

// The histogram in kRows rows. Bars are logarithmic: empty space outnumbers everything else in most volumes.
std::string HistogramText(const VolumeSummary& summary) {
  constexpr int kRows = 16, kBarWidth = 50;
  static_assert(kHistogramBins % kRows == 0);
  const int bins = kHistogramBins / kRows;
  std::array<std::uint64_t, kRows> rows{};
  for (int i = 0; i < kHistogramBins; ++i) rows[std::size_t(i / bins)] += summary.histogram[std::size_t(i)];
  const double most = std::log1p(double(*std::max_element(rows.begin(), rows.end())));
  std::string text;
  for (int row = 0; row < kRows; ++row) {
    const double width = (double(summary.range.max) - summary.range.min) / kRows;
    const std::uint64_t count = rows[std::size_t(row)];
    const int bar = most > 0 ? int(std::ceil(kBarWidth * std::log1p(double(count)) / most)) : 0;
    text += fmt::format("  {:>12.6g} {:>12} {}\n", summary.range.min + width * row, count, std::string(std::size_t(bar), '#'));
  }
  return text;
}

// "right to left" for a step that mostly goes to the patient's left; "-x" in a scene.
std::string DirectionName(World world, const Vec3& step) {
  Axis main = Axis::kX;
  for (const Axis axis : {Axis::kY, Axis::kZ}) {
    if (std::abs(step[axis]) > std::abs(step[main])) main = axis;
  }
  const bool up = step[main] > 0;
  if (world != World::kPatient) return fmt::format("{}{}", up ? '+' : '-', Letter(main));
  constexpr std::array<std::array<const char*, 2>, 3> kEnds = {{{"left", "right"}, {"posterior", "anterior"}, {"inferior", "superior"}}};
  const auto& [low, high] = kEnds[std::size_t(Number(main))];
  return fmt::format("{} to {}", up ? low : high, up ? high : low);
}

// Degrees by which the axes are turned against those of the world.
double ObliqueDegrees(const Orientation& orientation) {
  const double trace = orientation.axes[0].x + orientation.axes[1].y + orientation.axes[2].z;
  return std::acos(std::clamp((trace - 1) / 2, -1.0, 1.0)) * (180 / std::numbers::pi);
}

// " mm", or nothing if the file states no unit.
std::string UnitText(const VolumeGeometry& geometry) {
  const LengthUnit unit = UnitOf(geometry);
  return unit > LengthUnit::kFile ? fmt::format(" {}", NameOf(unit)) : "";
}

// A source of chunks does not tell.
StoredAxes StoredAxesOf(const SourceInfo& info) {
  const VolumeGeometry& geometry = info.finest().geometry;
  const Vec3& spacing = geometry.spacing;
  return info.stored.value_or(StoredAxes{geometry.size, {Vec3{spacing.x, 0, 0}, Vec3{0, spacing.y, 0}, Vec3{0, 0, spacing.z}}});
}

constexpr const char* kStoredAxes[] = {"stored_x", "stored_y", "stored_z"};

std::string OrientationText(const VolumeFacts& facts) {
  const SourceInfo& info = facts.file;
  const VolumeGeometry& geometry = info.finest().geometry;
  const Orientation& orientation = geometry.orientation;
  const Vec3 extent = ToVec3(geometry.size) * geometry.spacing;
  std::string text = fmt::format("extent       {:.6g} x {:.6g} x {:.6g}{}\n", extent.x, extent.y, extent.z, UnitText(geometry));
  if (orientation.world == World::kVoxels) return text + "orientation  unknown: x, y and z are the axes of the voxels\n";
  text += fmt::format("orientation  {}\n", orientation.world == World::kPatient ? "patient: x to the right, y to anterior, z to superior"
                                                                                : "scene: the file's own axes");
  text += fmt::format("origin       {:.6g} {:.6g} {:.6g}{}\n", orientation.origin.x, orientation.origin.y, orientation.origin.z,
                      UnitText(geometry));
  for (std::size_t i = 0; i < 3 && !facts.parts; ++i) {
    text += fmt::format("  the file's voxel {} runs {}\n", Letter(kAxes[i]), DirectionName(orientation.world, StoredAxesOf(info).steps[i]));
  }
  const double degrees = ObliqueDegrees(orientation);
  text += degrees < 0.05 ? "oblique      no\n" : fmt::format("oblique      by {:.1f} degrees\n", degrees);
  if (const StoredAxes stored = StoredAxesOf(info); stored.slanted) {
    text += fmt::format(
        "slanted      the file has {} x {} x {} voxels whose axes are not at right angles (a tilted gantry?); they are straightened\n",
        stored.size.x, stored.size.y, stored.size.z);
  }
  return text;
}

std::string SizeText(const Index3& size) { return fmt::format("{} x {} x {}", size.x, size.y, size.z); }

std::string PartsText(const SourceInfo& info) {
  std::string text = fmt::format("levels       {}: voxels, spacing, memory, block\n", info.levels.size());
  for (std::size_t i = 0; i < info.levels.size(); ++i) {
    const VolumeDescription& d = info.levels[i].description;
    const Vec3& spacing = d.geometry.spacing;
    text += fmt::format("  {:>2}  {}  {:.6g} {:.6g} {:.6g}{}  {:.1f} MiB  {}\n", i, SizeText(d.geometry.size), spacing.x, spacing.y,
                        spacing.z, UnitText(d.geometry), double(d.voxel_bytes()) / (1 << 20), SizeText(info.levels[i].block));
  }
  return text;
}

Json RangeJson(const ValueRange& range) { return {{"min", range.min}, {"max", range.max}}; }

std::string ChannelsText(const SourceInfo& info) {
  if (info.channels.empty()) return "";
  const std::string shown = fmt::format("; this is number {}\n", info.channel);
  if (info.components > 1) return fmt::format("components   {} of a voxel", info.components) + shown;
  std::string text = fmt::format("channels     {}: name, colour, window", info.channels.size()) + (info.channels.size() > 1 ? shown : "\n");
  for (std::size_t i = 0; i < std::min(info.channels.size(), kMaxFields); ++i) {
    const FieldInfo& channel = info.channels[i];
    const std::string window =
        channel.window ? fmt::format("{} ... {}", ValueText(channel.window->min), ValueText(channel.window->max)) : "no window";
    text += fmt::format("  {:>2}  \"{}\"  {}  {}{}\n", i, Printable(channel.name), channel.color ? ColorText(*channel.color) : "no colour",
                        window, channel.shown ? "" : "  (hidden)");
  }
  return text + (info.channels.size() > kMaxFields ? "  ...\n" : "");
}

Json ChannelsJson(const SourceInfo& info) {
  Json channels = Json::array();
  for (const FieldInfo& channel : info.channels) {
    channels.push_back({{"name", channel.name},
                        {"color", channel.color ? Json(ColorText(*channel.color)) : Json(nullptr)},
                        {"window", channel.window ? RangeJson(*channel.window) : Json(nullptr)},
                        {"shown", channel.shown}});
  }
  return channels;
}

std::string TimesText(const SourceInfo& info) {
  const auto& [count, step, unit] = info.times;
  if (count == 1) return "";
  const std::string apart = step ? fmt::format(", {:.6g}{}{} apart", *step, unit.empty() ? "" : " ", unit) : "";
  return fmt::format("times        {}{}; this is number {}\n", count, apart, info.time);
}

std::string NotesText(const SourceInfo& info) {
  std::string text;
  for (const std::string& note : info.notes) text += fmt::format("note         {}\n", Printable(note));
  return text;
}

std::string InfoText(const VolumeFacts& facts, const std::optional<IndexFacts>& index, const std::string& transfer, double occupancy) {
  const SourceInfo& info = facts.file;
  const VolumeSummary& summary = *facts.summary;
  const VolumeDescription& d = info.finest();
  const Vec3& spacing = d.geometry.spacing;
  std::string text = fmt::format("format       {}\n", info.format);
  text += fmt::format("size         {} voxels ({:.1f} MiB)\n", SizeText(d.geometry.size), double(d.voxel_bytes()) / (1 << 20));
  text += fmt::format("samples      {}, {} in the file; value = {} * sample + {}\n", NameOf(d.type), info.file_type,
                      ValueText(d.mapping.scale), ValueText(d.mapping.offset));
  if (info.labels) text += "labels       yes: values are numbers of structures, not measurements\n";
  text += fmt::format("spacing      {:.6g} {:.6g} {:.6g}{}\n", spacing.x, spacing.y, spacing.z, UnitText(d.geometry));
  text += OrientationText(facts);
  if (facts.parts) text += PartsText(facts.parts->source->info());
  text += TimesText(info) + ChannelsText(info) + NotesText(info);
  text += fmt::format("values       {} ... {}{}\n", ValueText(summary.range.min), ValueText(summary.range.max), OfWhichVoxels(facts));
  if (summary.non_finite > 0) text += fmt::format("not finite   {} voxels (never visible)\n", summary.non_finite);
  text += fmt::format("occupancy    {:.4g} under transfer function '{}'\n", occupancy, transfer);
  text += IndexText(index, transfer);
  return text + "histogram    lowest value of the row, voxels, bar by the logarithm of their number\n" + HistogramText(summary);
}

std::string JsonText(const Json& json) { return json.dump(2) + "\n"; }

// The labels and the overlay of the volume.
struct LayerFacts {
  std::shared_ptr<const LabelTable> labels;       // null: there are none
  std::map<std::uint64_t, std::uint64_t> voxels;  // of each label, if all were read
  std::optional<VolumeSummary> overlay;
};

Result<LayerFacts> FactsOf(const LayerFiles& files) {
  const DataSource source("", "", files);
  LayerFacts facts;
  if (source.labels != nullptr) {
    const Result<ReadableSource> read = ReadSource(*source.labels, std::uint64_t(kExactBytes));
    if (!read.ok()) return Status(read.status().code(), "labels: " + read.status().message());
    if (const auto* const opened = std::get_if<OpenedSource>(&*read)) {
      facts.labels = opened->survey.summary->labels;
    } else {
      const LoadedSource& loaded = std::get<LoadedSource>(*read);
      facts.labels = loaded.labels;
      const VoxelBlock& block = loaded.volume->block;
      VisitLabelType(block.type, [&]<class T>(const T*) {
        for (const T label : std::span(block.samples<T>(), std::size_t(block.box.voxel_count()))) {
          if (label > 0 && (loaded.labels->complete || facts.voxels.size() < kMaxLabels)) ++facts.voxels[label];
        }
      });
    }
  }
  if (source.overlay != nullptr) {
    const Result<SourceText> text = ParseSourceText(files.overlay);
    if (!text.ok()) return text.status();
    const Result<LoadedVolume> read = ReadVolume(text->path, text->options);
    if (!read.ok()) return read.status();
    facts.overlay = Summarize(*read->volume);
  }
  return facts;
}

std::string LayersText(const LayerFacts& facts) {
  std::string text;
  if (facts.labels != nullptr) {
    const std::size_t count = facts.labels->labels.size();
    text += facts.labels->complete
                ? fmt::format("labels       {}: value, colour, voxels, name\n", count)
                : fmt::format("labels       more than are counted; {} have a colour or a name: value, colour, name\n", count);
    for (const Label& label : facts.labels->labels) {
      const auto voxels = facts.voxels.find(label.value);
      text += fmt::format("  {:>8} {} {:>10} {}\n", label.value, ColorText(label.color),
                          facts.labels->complete ? fmt::format("{}", voxels == facts.voxels.end() ? 0 : voxels->second) : "", label.name);
    }
  }
  const std::optional<VolumeSummary>& overlay = facts.overlay;
  if (overlay) text += fmt::format("overlay      values {} ... {}\n", ValueText(overlay->range.min), ValueText(overlay->range.max));
  return text;
}

Json SizeJson(const Index3& index) { return {index.x, index.y, index.z}; }

Json LayersJson(const LayerFacts& facts) {
  Json json = Json::object();
  if (facts.labels != nullptr) {
    json["labels"] = Json::array();
    json["all_labels"] = facts.labels->complete;
    for (const Label& of : facts.labels->labels) {
      Json label = LabelJson(of);
      if (const auto voxels = facts.voxels.find(of.value); voxels != facts.voxels.end()) label["voxels"] = voxels->second;
      json["labels"].push_back(std::move(label));
    }
  }
  const std::optional<VolumeSummary>& overlay = facts.overlay;
  if (overlay) json["overlay"] = {{"range", RangeJson(overlay->range)}, {"no_value", overlay->non_finite}};
  return json;
}

void AddPartsJson(const VolumeFacts& facts, Json& json) {
  const SourceInfo& info = facts.parts->source->info();
  json["levels"] = Json::array();
  for (const SourceLevel& level : info.levels) {
    const VolumeGeometry& geometry = level.description.geometry;
    json["levels"].push_back({{"size", SizeJson(geometry.size)},
                              {"spacing", VectorJson(geometry.spacing)},
                              {"origin", VectorJson(geometry.orientation.origin)},
                              {"voxel_bytes", level.description.voxel_bytes()},
                              {"block", SizeJson(level.block)}});
  }
  json["statistics"] = {{"level", facts.parts->survey.level}, {"sample", facts.parts->survey.sample}, {"times", facts.summary->times}};
}

std::string InfoJson(const VolumeFacts& facts, const std::optional<IndexFacts>& index, const std::string& transfer, double occupancy,
                     const std::vector<DicomSeries>& series, const LayerFacts& layers) {
  const SourceInfo& info = facts.file;
  const VolumeSummary& summary = *facts.summary;
  const VolumeDescription& d = info.finest();
  const Orientation& orientation = d.geometry.orientation;
  Json world = {{"world", NameOf(orientation.world)},
                {"origin", VectorJson(orientation.origin)},
                {"axes", {VectorJson(orientation.axes[0]), VectorJson(orientation.axes[1]), VectorJson(orientation.axes[2])}},
                {"oblique_degrees", ObliqueDegrees(orientation)}};
  if (orientation.world != World::kVoxels && !facts.parts) {
    for (std::size_t i = 0; i < 3; ++i) world[kStoredAxes[i]] = DirectionName(orientation.world, StoredAxesOf(info).steps[i]);
  }
  world["straightened"] = StoredAxesOf(info).slanted;
  Json json = {{"format", info.format},
               {"size", SizeJson(d.geometry.size)},
               {"type", NameOf(d.type)},
               {"file_type", info.file_type},
               {"labels", info.labels},
               {"channels", ChannelsJson(info)},
               {"channel", info.channel},
               {"times", info.times.count},
               {"time_step", info.times.step ? Json(*info.times.step) : Json(nullptr)},
               {"time_unit", info.times.unit},
               {"time", info.time},
               {"notes", info.notes},
               {"voxel_bytes", d.voxel_bytes()},
               {"mapping", {{"scale", d.mapping.scale}, {"offset", d.mapping.offset}}},
               {"spacing", VectorJson(d.geometry.spacing)},
               {"unit", NameOf(UnitOf(d.geometry))},
               {"orientation", world},
               {"range", RangeJson(summary.range)},
               {"non_finite", summary.non_finite},
               {"transfer", transfer},
               {"occupancy", occupancy},
               {"histogram", summary.histogram}};
  if (facts.parts) {
    AddPartsJson(facts, json);
    json["index"] = IndexJson(index);
  }
  if (!series.empty()) json["series"] = SeriesJson(series);
  if (layers.labels != nullptr || layers.overlay) json["layers"] = LayersJson(layers);
  return JsonText(json);
}

}  // namespace

Status RunInfo(const InfoOptions& options) {
  if (Status kept = KeepObjects(options.cache); !kept.ok()) return kept;
  if (IsPicturePath(options.path)) return RunPictureInfo(options);
  if (NamesShape(options.path)) return RunShapeInfo(options);
  if (const auto source = ParseSourceText(options.path); source.ok() && LooksLikeMesh(source->path)) return RunMeshInfo(options);
  if (Status status = CheckInputVolume(options.path); !status.ok()) return status;
  const Result<std::vector<DicomSeries>> series = SeriesAt(options.path);
  if (!series.ok()) return series.status();
  if (NeedsChoice(*series, options.path)) {
    std::cout << (options.json ? JsonText({{"format", "DICOM"}, {"series", SeriesJson(*series)}})
                               : SeriesText(*series) + "several series are volumes: choose one with --series NUMBER or --series UID\n");
    return Status::Ok();
  }
  if (!options.json) std::cout << SeriesText(*series);
  const Result<VolumeFacts> facts = FactsOf(options.path);
  if (!facts.ok()) return facts.status();

  const Result<TransferFunction> transfer = ResolveTransfer(options.request.transfer, *facts->summary);
  if (!transfer.ok()) return transfer.status();
  const double occupancy = OccupancyOf(*facts->summary, *transfer);

  const Result<LayerFacts> layers = FactsOf(options.layers);
  if (!layers.ok()) return layers.status();

  const std::string name = TransferName(options.request.transfer);
  std::optional<IndexFacts> index;
  if (facts->parts) index = IndexFactsOf(options.path, *facts->parts, *transfer);
  std::cout << (options.json ? InfoJson(*facts, index, name, occupancy, *series, *layers)
                             : InfoText(*facts, index, name, occupancy) + LayersText(*layers));
  return Status::Ok();
}

}  // namespace slabstream
