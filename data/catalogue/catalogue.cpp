#include "data/catalogue/catalogue.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <functional>
#include <optional>
#include <system_error>
#include <thread>
#include <utility>

#include "common/base/log.h"
#include "common/frame/dataset_name.h"
#include "common/frame/frame_request.h"
#include "common/text/url.h"
#include "common/wire/limits.h"
#include "data/brick_store/brick_store.h"
#include "data/catalogue/client_file.h"
#include "data/catalogue/other_times.h"
#include "data/catalogue/shape_data.h"
#include "data/layers/label_table.h"
#include "data/open/open_source.h"
#include "data/open/read_volume.h"
#include "data/open/source_name.h"
#include "data/open/unchanged_source.h"
#include "data/shapes/shape_file.h"
#include "data/sources/hollow_source.h"
#include "data/volume_io/exact_samples.h"
#include "data/volume_io/formats.h"
#include "data/volume_io/read_options.h"
#include "data/volume_io/slice_stack.h"

namespace slabstream {
namespace {

namespace fs = std::filesystem;

// The beginning of an argument that is too long for a message.
std::string Shown(const std::string& argument) {
  constexpr std::size_t kMost = 512;
  return argument.size() <= kMost ? argument : argument.substr(0, kMost) + "...";
}

bool IsFolder(const fs::path& path) {
  std::error_code error;
  return fs::is_directory(path, error);
}

bool IsHidden(const fs::path& path) { return path.filename().string().starts_with('.'); }

bool HasFiles(const std::string& folder) {
  std::error_code error;
  const fs::directory_iterator entries(folder, error);
  return !error && std::any_of(begin(entries), end(entries), [](const fs::directory_entry& entry) {
    std::error_code unreadable;
    return entry.is_regular_file(unreadable) && !IsHidden(entry.path());
  });
}

// Whether the folder is a volume, and nothing in it is one of another format. One of nothing but folders, such as those of DICOM studies,
// holds a volume in each.
bool IsOneVolume(const std::string& folder, const std::vector<fs::path>& volumes) {
  const VolumeFormat* const format = FindFormat(folder);
  return format != nullptr && HasFiles(folder) &&
         std::ranges::all_of(volumes, [&](const fs::path& path) { return FindFormat(path.string()) == format; });
}

Status Repeated(const std::string& name) { return Status::InvalidArgument("there is already a dataset named \"" + name + "\""); }

// Adds what is in the folder, by its names (NamesOfSources). What is named already has precedence.
void AddContents(FoundData& found, const std::string& folder, const std::vector<fs::path>& files) {
  std::vector<std::string> volumes(files.begin(), files.end());
  const auto shapes = std::ranges::stable_partition(volumes, [](const std::string& path) { return !HoldsShape(path); });
  if (IsOneVolume(folder, {volumes.begin(), shapes.begin()})) {
    volumes.erase(volumes.begin(), shapes.begin());
    volumes.insert(volumes.begin(), folder);
  }
  const std::vector<std::string> names = NamesOfSources(volumes);
  for (std::size_t i = 0; i < volumes.size(); ++i) {
    const std::string usual = NameOfSource(volumes[i]);
    if (!found.datasets.emplace(names[i], DataSource(volumes[i], folder)).second) {
      found.complaints.push_back(volumes[i] + ": left out: " + Repeated(names[i]).message());
    } else if (names[i] != usual) {
      found.complaints.push_back(
          fmt::format("{}: its dataset is named \"{}\", since \"{}\" is that of another file", volumes[i], names[i], usual));
    }
  }
}

// The files and folders in a folder that are volumes, by name.
Result<std::vector<fs::path>> VolumeFilesIn(const std::string& folder) {
  std::vector<fs::path> files;
  std::error_code error;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end; entry.increment(error)) {
    const fs::path& path = entry->path();
    if (IsHidden(path) || IsPicture(path.string())) continue;  // pictures lie about for other reasons
    if (LooksLikeVolume(path.string()) || HoldsShape(path.string())) files.push_back(path);
  }
  if (error) {
    const bool missing = error == std::errc::no_such_file_or_directory || error == std::errc::not_a_directory;
    return Status(missing ? StatusCode::kNotFound : StatusCode::kUnavailable, folder + ": cannot read the folder: " + error.message());
  }
  std::ranges::sort(files);
  return files;
}

// Finds out what the argument names, a path that exists.
Status AddNamed(FoundData& found, const DataArgument& argument) {
  const Result<SourceText> source = ParseSourceText(argument.path);
  if (!source.ok()) return source.status();
  if (!MayBeThere(*source)) return Status::NotFound("does not exist");
  const auto add = [&](const std::string& name, const std::string& path) {
    return found.datasets.emplace(name, DataSource(path, "", argument.layers)).second ? Status::Ok() : Repeated(name);
  };
  const TimeRange times = source->options.time.value_or(TimeRange{});
  if (times.count() == 1) return add(argument.name, argument.path);
  if (times.count() > kMaxTimes) {
    return Status::InvalidArgument(fmt::format("time {}:{} names {} volumes, limit {}", times.first, times.last, times.count(), kMaxTimes));
  }
  if (const std::size_t length = NameAtTime(argument.name, times.last).size(); length > kMaxNameBytes) {
    return Status::InvalidArgument(fmt::format("the name with its time has {} bytes, limit {}", length, kMaxNameBytes));
  }
  for (int time = times.first; time <= times.last; ++time) {
    if (Status added = add(NameAtTime(argument.name, time), AtTime(argument.path, time)); !added.ok()) return added;
  }
  return Status::Ok();
}

// Whether a path without a name is a folder to watch. A store of objects such as an OME-Zarr is one volume. A folder of slices is watched:
// it is one volume as long as nothing else lies in it.
bool IsWatched(const std::string& path) {
  if (!IsFolder(path)) return false;
  const VolumeFormat* const format = FindFormat(path);
  return format == nullptr || format->markers.empty();
}

// As the name of a dataset, or of several times.
bool HasName(const FoundData& found, const std::string& name) {
  const auto next = found.datasets.lower_bound(name + "@");
  return found.datasets.contains(name) || (next != found.datasets.end() && NameWithoutTime(next->first) == name);
}

Status AddFolder(FoundData& found, const std::string& path) {
  const std::string folder = WatchedFolder(path);
  if (std::ranges::find(found.folders, folder) != found.folders.end()) return Status::InvalidArgument("the folder is given before it");
  const Result<std::vector<fs::path>> files = VolumeFilesIn(folder);
  if (!files.ok()) return files.status();
  const std::size_t before = found.datasets.size() + found.complaints.size();
  AddContents(found, folder, *files);
  if (found.datasets.size() + found.complaints.size() == before) found.complaints.push_back(folder + ": no volume file in this folder yet");
  found.folders.push_back(folder);
  return Status::Ok();
}

// Those of folders for which the catalogue has no room.
void LeaveOutMost(FoundData& found) {
  std::size_t left_out = 0;
  for (auto next = found.datasets.end(); next != found.datasets.begin() && found.datasets.size() > kMaxListed;) {
    --next;
    if (next->second.folder.empty()) continue;
    next = found.datasets.erase(next);
    ++left_out;
  }
  if (left_out == 0) return;
  found.complaints.push_back(fmt::format("{} volumes of folders are left out: the catalogue has at most {}", left_out, kMaxListed));
}

Status CheckHeaders(const DataSource& data) {
  if (data.is_shape) return FindShapeFile(data.path).status();
  Result<SourceText> source = ParseSourceText(data.path);
  if (!source.ok()) return source.status();
  source->options.describe = true;
  if (const auto files = CheckVolumeHeaders(source->path, source->options); !files.ok()) return files.status();
  if (source->options.labels) {
    if (const auto colors = ReadLabelColors(source->path, data.label_colors); !colors.ok()) return colors.status();
  }
  return CheckFields(data);
}

// Moves ",labels=..." and ",overlay=..." from the end of a named path to `layers`.
Status TakeLayers(std::string& path, LayerFiles& layers) {
  constexpr std::array<std::string_view, 2> kMarks = {",labels=", ",overlay="};
  std::string labels;
  const std::array<std::string*, 2> targets = {&labels, &layers.overlay};
  while (true) {
    std::size_t at = std::string::npos, which = 0;
    for (std::size_t i = 0; i < kMarks.size(); ++i) {
      const std::size_t found = path.rfind(kMarks.at(i));
      if (found == std::string::npos || (at != std::string::npos && found < at)) continue;
      at = found;
      which = i;
    }
    if (at == std::string::npos) break;
    const std::string_view name = kMarks.at(which).substr(1, kMarks.at(which).size() - 2);
    std::string& target = *targets.at(which);
    if (!target.empty()) return Status::InvalidArgument(fmt::format("{} are given twice", name));
    target = path.substr(at + kMarks.at(which).size());
    if (target.empty() || target.size() > kMaxPathBytes) {
      return Status::InvalidArgument(fmt::format("{}: a path of {} bytes, must have 1 to {}", name, target.size(), kMaxPathBytes));
    }
    path.resize(at);
  }
  if (!labels.empty()) SetLabelFiles(labels, layers);
  return Status::Ok();
}

// Pictures are the same without it, so whatever is wrong with it is but a warning.
std::shared_ptr<const BrickIndex> FindIndex(const std::string& source_text, const SourceInfo& info) {
  const Result<IndexFile> file = IndexFileOf(source_text);
  if (!file.ok() || !file->facts()) return nullptr;
  const Result<std::string> name = file->NameNow(info.version, info);
  Result<std::optional<BrickIndex>> index = name.ok() ? file->Read(*name, info) : name.status();
  if (!index.ok()) {
    LogWarning(fmt::format("the index of {} is not used: {}; `slabstream index` makes a new one", source_text, index.status().message()));
  }
  return index.ok() && *index ? std::make_shared<const BrickIndex>(**std::move(index)) : nullptr;
}

// All times of a dataset look alike.
void AddOtherTimes(const DataSource& source, ReadableSource& read) {
  if (source.statistics != nullptr) return;
  if (auto* const loaded = std::get_if<LoadedSource>(&read)) {
    loaded->other_times = SurveyOtherTimes(source.path, loaded->file, loaded->source.get());
    return;
  }
  auto& opened = std::get<OpenedSource>(read);
  const std::vector<VolumeSummary> others = SurveyOtherTimes(source.path, opened.source->info(), opened.source.get());
  if (!others.empty()) opened.survey.summary = std::make_shared<const VolumeSummary>(OverTimes(*opened.survey.summary, others));
}

Status BeingWritten(const DataSource& source) {
  return Status::Unavailable(source.path.substr(0, source.path.find('?')) + ": the file is being written; the next request reads it again");
}

// Waits until the files were not changed for longer than a tick of the file system's clock. Then their stamp tells of every change from now
// on. Whoever writes them piece by piece is also likely to have come to an end.
void AwaitRest(const FileStamp& stamp) {
  constexpr std::chrono::milliseconds kRest(50);
  const auto now = std::chrono::system_clock::now();
  const bool is_fresh = stamp.newest > now - kRest && stamp.newest <= now;  // a clock that is ahead of ours tells nothing
  if (is_fresh) std::this_thread::sleep_for(kRest - (now - stamp.newest));
}

// How a source is read: what of it may change, and the reading.
struct WayToRead {
  std::shared_ptr<VolumeSource> source;
  std::vector<std::string> files;
  std::function<Result<ReadableSource>()> read;
};

// `labels`: null: it has values. `statistics`: DataSource::statistics.
Result<ReadableSource> Surveyed(std::shared_ptr<VolumeSource> source, std::string place, std::shared_ptr<const BrickIndex> index,
                                ReadProgress& progress, const std::shared_ptr<const VolumeSummary>& statistics,
                                std::shared_ptr<const LabelTable> labels = nullptr) {
  if (statistics != nullptr) {
    auto known = std::make_shared<const VolumeSummary>(UnreadSummary(source->info().finest(), *statistics));
    return ReadableSource(OpenedSource{std::move(source), {0, true, std::move(known)}, std::move(place), nullptr, std::move(index)});
  }
  Result<Survey> survey = SurveySource(*source, SurveyBytesOf(source->info(), !SchemeOf(place).empty()), &progress);
  if (!survey.ok()) return survey.status();
  if (labels != nullptr) {
    VolumeSummary with_labels = *survey->summary;
    with_labels.labels = std::move(labels);
    survey->summary = std::make_shared<const VolumeSummary>(std::move(with_labels));
  }
  const ValueRange& range = survey->summary->range;
  const SampleType type = source->info().exact.type;
  constexpr double kExactFloats = 1 << 24;  // float32 holds all whole numbers up to here
  if (survey->summary->labels == nullptr && MayRoundLabels(type) && std::max(std::abs(range.min), std::abs(range.max)) > kExactFloats) {
    LogWarning(place + ": " + RoundingText(type));
  }
  return ReadableSource(OpenedSource{std::move(source), *std::move(survey), std::move(place), nullptr, std::move(index)});
}

// Channels and times are those of the dataset. Of a voxel's components it has the first one.
void WarnOfComponents(const SourceText& text, const SourceInfo& info) {
  ReadOptions options = text.options;
  options.time.emplace();
  if (info.components > 1) WarnOfPart(text.path, options, info);
}

// What is known of labels: all of them are those of `whole`; null: nobody has read them. Null: the source has values.
Result<std::shared_ptr<const LabelTable>> KnownLabels(const SourceText& text, const std::string& named_colors, const SourceInfo& info,
                                                      const Volume* whole) {
  if (!text.options.labels) return std::shared_ptr<const LabelTable>();
  const Result<FoundColors> colors = ReadLabelColors(text.path, named_colors);
  if (!colors.ok()) return colors.status();
  return std::make_shared<const LabelTable>(
      MakeLabelTable(whole == nullptr ? std::nullopt : ValuesOfLabels(*whole), colors->table, info.looks));
}

Result<ReadableSource> ReadWhole(VolumeSource& source, const SourceText& text, const std::string& label_colors) {
  Result<LoadedVolume> read = ReadVolume(source, text.path, text.options, {.summary = true});
  if (!read.ok()) return read.status();
  if (!read->rounding.empty()) LogWarning(text.path + ": " + read->rounding);
  WarnOfComponents(text, read->info);
  Result<std::shared_ptr<const LabelTable>> labels = KnownLabels(text, label_colors, read->info, read->volume.get());
  if (!labels.ok()) return labels.status();
  return ReadableSource(LoadedSource{.file = std::move(read->info),
                                     .volume = std::move(read->volume),
                                     .summary = std::move(read->summary),
                                     .labels = *std::move(labels),
                                     .stamp = nullptr,
                                     .exact = std::move(read->exact),
                                     .cells = std::move(read->cells)});
}

// Other processes may run in other folders.
std::string PlaceOf(const DataSource& data, const SourceText& text, const SourceInfo& info) {
  if (!info.owned.empty()) return info.owned;
  return IsUrl(text.path) ? data.path : fs::absolute(text.path).string() + text.options_text;
}

// Of a stream, or samples in several files, larger than what may be held.
Result<ReadableSource> ReadStream(const DataSource& data, std::uint64_t most_bytes, ReadProgress& progress) {
  constexpr std::uint64_t kLeastMemory = std::uint64_t{64} << 20, kMostMemory = std::uint64_t{1} << 30;
  const Result<StoreFolder> stores = StoreFolder::Usual();
  if (!stores.ok()) return stores.status();
  Result<StoredStream> stored =
      OpenStored(data.path, *stores, ProcessReadContext(), {.memory = std::clamp(most_bytes, kLeastMemory, kMostMemory)}, &progress);
  if (!stored.ok()) return stored.status();
  return Surveyed(std::move(stored->source), std::move(stored->path), nullptr, progress, data.statistics);
}

// `beside`: as of OpenSource.
Result<WayToRead> FindWay(const DataSource& data, VolumeSource* beside, std::uint64_t most_bytes, ReadProgress& progress) {
  Result<SourceText> text = ParseSourceText(data.path);
  if (!text.ok()) return text.status();
  text->options.progress = &progress;
  text->options.describe = true;
  const bool owned = data.open && beside == nullptr;
  const auto opened = owned ? data.open(data.missing) : OpenSource(text->path, text->options, ProcessReadContext(), beside);
  if (!opened.ok()) return opened.status();
  std::shared_ptr<VolumeSource> source = *opened;
  std::string place = PlaceOf(data, *text, source->info());
  const bool labels_alone = source->info().labels && MayRoundLabels(source->info().exact.type);
  if (!data.is_field && data.labels == nullptr && labels_alone) {
    source = AsHollow(source);
    place = WithReadOption(WithoutReadOption(place, "ids"), "hollow", "yes");
    text->options.labels = false;
  }
  const SourceInfo& info = source->info();
  WayToRead way{source, info.files, {}};
  const auto most = std::int64_t(std::min<std::uint64_t>(most_bytes, kExactBytes));
  const bool is_large = info.levels.size() > 1 || info.finest().voxel_bytes() > most || !info.owned.empty();
  const bool labels = text->options.labels;
  // Their files; they are read again, with the voxels, once their stamp is taken.
  const Result<FoundColors> colors = labels ? ReadLabelColors(text->path, data.label_colors) : Result<FoundColors>(FoundColors());
  if (!colors.ok()) return colors.status();
  way.files.insert(way.files.end(), colors->files.begin(), colors->files.end());
  if (info.whole || !is_large || (labels && info.slices)) {
    way.read = [source, text = *std::move(text), named = data.label_colors] { return ReadWhole(*source, text, named); };
  } else if (info.slices) {
    way.read = [data, most_bytes, &progress] { return ReadStream(data, most_bytes, progress); };
  } else {
    way.read = [source, data, place = std::move(place), text = *text, &progress]() -> Result<ReadableSource> {
      WarnOfComponents(text, source->info());
      const Result<std::shared_ptr<const LabelTable>> known = KnownLabels(text, data.label_colors, source->info(), nullptr);
      if (!known.ok()) return known.status();
      const auto index = source->info().hollow ? nullptr : FindIndex(data.path, source->info());
      return Surveyed(source, place, index, progress, data.statistics, *known);
    };
  }
  return way;
}

// Of all that was read. A source may have more files than its volume, which come with it.
Result<std::shared_ptr<const FileStamp>> StampOf(const ReadableSource& read, const FileStamp& before) {
  const auto* const opened = std::get_if<OpenedSource>(&read);
  const SourceInfo& info = opened != nullptr ? opened->source->info() : std::get<LoadedSource>(read).file;
  if (info.growth != nullptr && info.growth->ask) return info.growth;
  std::vector<std::string> files = opened != nullptr ? info.files : before.paths;
  if (info.growth != nullptr) files.insert(files.end(), info.growth->paths.begin(), info.growth->paths.end());
  Result<FileStamp> stamp = StampFiles(std::move(files));
  if (!stamp.ok()) return stamp.status();
  const Result<bool> grown = info.growth != nullptr ? HaveChanged(*info.growth) : Result<bool>(false);
  if (!grown.ok() || *grown) return info.growth;  // the next look sees it
  return std::make_shared<const FileStamp>(*std::move(stamp));
}

}  // namespace

Status CheckFields(const DataSource& source) {
  for (const auto& [field, of] : {std::pair("overlay", source.overlay), std::pair("labels", source.labels)}) {
    const Status status = of != nullptr ? CheckHeaders(*of) : Status::Ok();
    if (!status.ok()) return {status.code(), fmt::format("{}: {}", field, status.message())};
  }
  return Status::Ok();
}

DataSource::DataSource(std::string from_path, std::string of_folder, const LayerFiles& layers)
    : path(std::move(from_path)), folder(std::move(of_folder)), is_shape(NamesShape(path)) {
  if (!layers.overlay.empty()) overlay = std::make_shared<const DataSource>(layers.overlay, folder);
  if (layers.labels.empty()) return;
  DataSource of_labels = LabelsAt(DataSource(layers.labels, folder));
  of_labels.label_colors = layers.label_colors;
  labels = std::make_shared<const DataSource>(std::move(of_labels));
}

DataSource LabelsAt(DataSource source) {
  source.overlay = source.labels = nullptr;
  source.is_field = true;
  source.path = WithoutReadOption(source.path, "hollow");
  const Result<SourceText> text = ParseSourceText(source.path);
  if (!text.ok() || !text->options.labels) source.path = WithReadOption(source.path, "ids", "yes");
  return source;
}

const std::string* DataArgument::RelativePath() const {
  for (const std::string* file : {&path, &layers.labels, &layers.label_colors, &layers.overlay}) {
    if (!file->empty() && !file->starts_with('/') && SchemeOf(*file).empty()) return file;
  }
  return nullptr;
}

Result<DataArgument> ParseDataArgument(const std::string& argument) {
  // What stands before an '=' is no name if it is an address, or ends in an option or a layer.
  const std::size_t first = argument.find('='),
                    equals = argument.find_first_of("?,") < first || argument.find("://") < first ? std::string::npos : first;
  DataArgument parsed;
  if (equals != std::string::npos) parsed.name = argument.substr(0, equals);
  parsed.path = equals == std::string::npos ? argument : argument.substr(equals + 1);
  const auto wrong = [&](const std::string& why) { return Status::InvalidArgument(Shown(argument) + ": " + why); };
  if (equals != std::string::npos) {
    if (Status name = CheckDatasetName(parsed.name); !name.ok()) return wrong(name.message());
  }
  if (parsed.path.empty() || parsed.path.size() > kMaxPathBytes) {
    return wrong(fmt::format("a path of {} bytes, must have 1 to {}", parsed.path.size(), kMaxPathBytes));
  }
  if (parsed.path.find('\0') != std::string::npos) return wrong("a path with a zero byte");
  if (Status layers = TakeLayers(parsed.path, parsed.layers); !layers.ok()) return wrong(layers.message());
  if (parsed.path.empty()) return wrong("layers without a volume");
  return parsed;
}

std::string WatchedFolder(const std::string& path) {
  std::error_code error;
  const fs::path whole = fs::absolute(path, error).lexically_normal();
  return (whole.has_filename() || !whole.has_relative_path() ? whole : whole.parent_path()).string();
}

FoundData FindData(const std::vector<std::string>& arguments, const std::string& prefix) {
  FoundData found;
  std::vector<std::pair<std::string, DataArgument>> folders, unnamed;
  const auto note = [&](const std::string& argument, const Status& status) {
    if (!status.ok()) found.errors.emplace_back(status.code(), prefix + Shown(argument) + ": " + status.message());
  };
  // What is named first: what lies in folders gives way.
  for (const std::string& argument : arguments) {
    const Result<DataArgument> parsed = ParseDataArgument(argument);
    if (!parsed.ok()) {
      found.errors.emplace_back(parsed.status().code(), prefix + parsed.status().message());
    } else if (parsed->name.empty()) {
      (IsWatched(parsed->path) ? folders : unnamed).emplace_back(argument, *parsed);
    } else {
      note(argument, AddNamed(found, *parsed));
    }
  }
  for (auto& [argument, volume] : unnamed) {
    const std::string usual = NameOfSource(volume.path);
    volume.name = usual;
    for (int number = 2; HasName(found, volume.name); ++number) volume.name = fmt::format("{}-{}", usual, number);
    const Status added = AddNamed(found, volume);
    note(argument, added);
    if (added.ok() && volume.name != usual) {
      found.complaints.push_back(
          fmt::format("{}: its dataset is named \"{}\", since \"{}\" is that of another file", volume.path, volume.name, usual));
    }
  }
  if (found.datasets.size() > kMaxListed) {
    found.errors.push_back(Status::InvalidArgument(
        fmt::format("{}{} volumes are named, the catalogue has at most {}", prefix, found.datasets.size(), kMaxListed)));
    return found;
  }
  for (const auto& [argument, folder] : folders) {
    note(argument, folder.layers.any() ? Status::InvalidArgument("layers belong to one volume, and this is a folder to watch")
                                       : AddFolder(found, folder.path));
  }
  LeaveOutMost(found);
  return found;
}

Result<FoundData> ListFolder(const std::string& folder) {
  const Result<std::vector<fs::path>> files = VolumeFilesIn(folder);
  if (!files.ok()) return files.status();
  FoundData found;
  AddContents(found, folder, *files);
  return found;
}

void CheckFiles(FoundData& found) {
  std::string_view refused;  // the name of which a time was refused; one error is enough
  for (const auto& [name, source] : found.datasets) {
    if (NameWithoutTime(name) == refused) continue;
    const Status readable = source.load ? Status::Ok() : CheckHeaders(source);
    if (readable.ok()) continue;
    if (source.folder.empty()) {
      refused = NameWithoutTime(name);
      // A damaged file is bad input, as a wrong name is.
      const StatusCode code = readable.code() == StatusCode::kDataLoss ? StatusCode::kInvalidArgument : readable.code();
      found.errors.emplace_back(code, fmt::format("dataset \"{}\": {}", name, readable.message()));
    } else {
      found.complaints.push_back(readable.message());
    }
  }
}

Result<IndexFile> IndexFileOf(const std::string& source) {
  const Result<SourceText> parsed = ParseSourceText(source);
  if (!parsed.ok()) return parsed.status();
  return IndexFile::Of(parsed->path, parsed->options_text);
}

Result<ReadableSource> ReadSource(const DataSource& source, std::uint64_t most_bytes, const TellRead& tell) {
  if (source.load) {
    Result<LoadedData> loaded = source.load(tell);
    if (!loaded.ok()) return loaded.status();
    return ReadableSource(LoadedSource{.volume = std::move(loaded->volume),
                                       .labels = std::move(loaded->labels),
                                       .exact = std::move(loaded->exact),
                                       .shape = std::move(loaded->shape)});
  }
  if (source.is_shape) {
    Result<LoadedSource> shape = LoadShape(source.path, tell);
    return shape.ok() ? Result<ReadableSource>(*std::move(shape)) : shape.status();
  }
  constexpr int kAttempts = 2;
  for (int attempt = 0; attempt < kAttempts; ++attempt) {
    ReadProgress progress(tell);
    const Result<WayToRead> way = FindWay(source, attempt == 0 ? source.beside.get() : nullptr, most_bytes, progress);
    if (!way.ok()) return way.status();
    if (const Status alone = source.sent ? source.sent->CheckAlone(way->files) : Status::Ok(); !alone.ok()) return alone;
    const Result<FileStamp> before = StampFiles(way->files);
    if (!before.ok()) return before.status();
    AwaitRest(*before);
    const SourceInfo& opened = way->source->info();
    const Result<std::uint64_t> version = VersionOf(opened.files);
    if (!opened.files.empty() && (!version.ok() || *version != opened.version)) continue;  // they have changed since it was opened
    Result<ReadableSource> read = way->read();
    if (!read.ok() && opened.growth != nullptr && attempt + 1 < kAttempts) {
      const Result<bool> grown = HaveChanged(*opened.growth);
      if (grown.ok() && *grown) continue;
    }
    auto* const loaded = read.ok() ? std::get_if<LoadedSource>(&*read) : nullptr;
    if (loaded != nullptr && opened.in_parts()) loaded->source = way->source;
    if (read.ok()) AddOtherTimes(source, *read);
    Result<std::shared_ptr<const FileStamp>> stamp = std::shared_ptr<const FileStamp>();
    if (read.ok()) stamp = StampOf(*read, *before);
    const Result<bool> changed = HaveChanged(*before);
    if (!changed.ok() || *changed || !stamp.ok()) continue;
    if (read.ok()) std::visit([&](auto& each) { each.stamp = *std::move(stamp); }, *read);
    return read;
  }
  return BeingWritten(source);
}

}  // namespace slabstream
