#include "data/open/open_source.h"

#include <algorithm>
#include <atomic>
#include <filesystem>
#include <new>

#include "common/base/printable.h"
#include "common/text/url.h"
#include "common/volume/memory_budget.h"
#include "data/hdf5/hdf5_format.h"
#include "data/metadata/open_store_for.h"
#include "data/open/file_times.h"
#include "data/open/remote_source.h"
#include "data/open/unchanged_source.h"
#include "data/owned/owned_source.h"
#include "data/positional/file_source.h"
#include "data/sources/even_source.h"
#include "data/sources/hollow_source.h"
#include "data/sources/label_source.h"
#include "data/sources/magnitude_source.h"
#include "data/sources/rectilinear_source.h"
#include "data/survey/survey.h"
#include "data/tiles/tiled_tiff.h"
#include "data/volume_io/chosen_channel.h"
#include "data/volume_io/formats.h"
#include "data/volume_io/raw_volume.h"

namespace slabstream {

// Each in the folder of its name; AMReX's and VTK's in data/mosaic.
VolumeFormat Amrex();
VolumeFormat N5();
VolumeFormat Precomputed();
VolumeFormat VtkParallelImage();
VolumeFormat Xdmf();
VolumeFormat Zarr();

namespace {

// A third of it, at most twice 128 MiB, for chunks under way, the rest for those that may be needed again. A small level, of which a survey
// from afar reads all, is then read once more by who holds it.
ReadContext::Limits LimitsFor(std::uint64_t process_bytes) {
  constexpr std::uint64_t kLeast = 8U << 20, kMostUnderWay = 128U << 20;
  const std::uint64_t all = std::max(SourceBytes(process_bytes), 3 * kLeast), under_way = std::clamp(all / 6, kLeast, kMostUnderWay);
  return {.under_way_bytes = under_way, .cache_bytes = all - 2 * under_way, .small_bytes = std::uint64_t(kFarSurvey.exact)};
}

std::atomic<std::uint64_t> process_memory = 0;  // 0: not said

Result<std::shared_ptr<VolumeSource>> OpenAs(const VolumeFormat& format, const std::string& path, const ReadOptions& options,
                                             const SourceContext& context) try {
  Result<std::shared_ptr<VolumeSource>> source = std::shared_ptr<VolumeSource>();
  if (format.open != nullptr) source = format.open(path, options, context);
  if (source.ok() && *source == nullptr) source = OpenFile(format, path, options, context);
  if (!source.ok()) return source;
  if (!options.resample) return AsRectilinear(path, *std::move(source));
  if (options.labels) return Status::InvalidArgument(path + ": --ids says that values are labels, which are not resampled");
  return MakeEven(path, *std::move(source), *options.resample);
} catch (const std::bad_alloc&) {
  return Status::ResourceExhausted(path + ": does not fit the memory");
}

}  // namespace

const std::vector<VolumeFormat>& VolumeFormats() {
  static const std::vector<VolumeFormat> kFormats = [] {
    std::vector<VolumeFormat> formats = {Amrex(), Hdf5(), N5(), Precomputed(), VtkParallelImage(), Xdmf(), Zarr()};
    formats.insert(formats.end(), FileFormats().begin(), FileFormats().end());
    std::ranges::find(formats, "TIFF", &VolumeFormat::name)->open = OpenTiff;
    return formats;
  }();
  return kFormats;
}

const VolumeFormat* FindFormat(const std::string& path, const ReadOptions& options) {
  if (IsUrl(path)) return nullptr;
  if (!NamesFileTimes(path)) return FindFormat(VolumeFormats(), path, options);
  const Result<std::string> first = FirstFileOf(path);
  return first.ok() ? FindFormat(VolumeFormats(), *first, options) : nullptr;
}

Status CheckVolume(const std::string& path, const ReadOptions& options) {
  if (IsUrl(path)) return Status::Ok();
  if (NamesFileTimes(path)) {
    const Result<std::string> first = FirstFileOf(path);
    ReadOptions of_file = options;
    of_file.time.reset();
    return first.ok() ? CheckVolume(*first, of_file) : Printable(first.status());
  }
  std::error_code error;
  const auto kind = std::filesystem::status(path, error).type();
  if (kind == std::filesystem::file_type::not_found) return Printable(Status::NotFound(path + ": no such file"));
  if (kind != std::filesystem::file_type::directory && kind != std::filesystem::file_type::regular) {
    return Printable(Status::InvalidArgument(path + ": not a file that can be read"));
  }
  if (const VolumeFormat* const format = FindFormat(path, options)) return Printable(CheckOptions(*format, path, options));
  const std::string_view why = WhyUnread(path);
  return Printable(
      Status::InvalidArgument(path + ": " + (why.empty() ? "not a volume, which " + ReadableText(VolumeFormats()) : std::string(why))));
}

bool LooksLikeVolume(const std::string& path) { return CheckVolume(path).ok(); }

namespace {

Result<std::shared_ptr<VolumeSource>> OpenValues(const std::string& path, const ReadOptions& options, const SourceContext& context) {
  if (!IsUrl(path) && NamesFileTimes(path)) {
    const auto open = [&](const std::string& file, const ReadOptions& of_file) { return OpenValues(file, of_file, context); };
    Result<std::shared_ptr<VolumeSource>> source = OpenFileTimes(path, options, open);
    return source.ok() ? source : Printable(source.status());
  }
  if (!IsUrl(path)) {
    if (Status status = CheckVolume(path, options); !status.ok()) return status;
    const VolumeFormat& format = *FindFormat(path, options);
    Result<std::shared_ptr<VolumeSource>> source = OpenUnchanged(path, [&] { return OpenAs(format, path, options, context); });
    if (!source.ok()) return Printable(source.status());
    return source;
  }
  ReadOptions with_store = options;
  Result<std::shared_ptr<Store>> store = OpenStoreFor(path, options);
  if (!store.ok()) return store.status();
  with_store.store = *std::move(store);
  const Result<RemoteFormat> found = FindRemoteFormat(*with_store.store, VolumeFormats());
  if (!found.ok()) return found.status();
  if (Status status = CheckOptions(*found->format, path, options); !status.ok()) return status;
  return OpenRemote(found->version, options.query, [&] { return OpenAs(*found->format, path, with_store, context); });
}

// The magnitude of a vector whose components are channels. Of a grid its reader makes it; any other reader says which channels there are.
Result<std::shared_ptr<VolumeSource>> OpenMagnitude(const std::string& path, const ReadOptions& options, const SourceContext& context) {
  ReadOptions of_component = options;
  of_component.channel = 0;
  Result<std::shared_ptr<VolumeSource>> opened = OpenValues(path, of_component, context);
  if (!opened.ok()) return opened;
  const SourceInfo& info = (*opened)->info();
  const int count = int(info.channels.size());
  if (count < 2 || count > kMostVectorComponents) return OpenValues(path, options, context);
  std::vector<std::shared_ptr<VolumeSource>> components = {*opened};
  for (of_component.channel = 1; *of_component.channel < count; ++*of_component.channel) {
    std::shared_ptr<VolumeSource> at = components.front()->At(info.time, *of_component.channel);
    opened = at != nullptr ? Result(std::move(at)) : OpenValues(path, of_component, context);
    if (!opened.ok()) return opened;
    components.push_back(*std::move(opened));
  }
  return MagnitudeOf(std::move(components));
}

std::shared_ptr<VolumeSource> Beside(VolumeSource& open, const ReadOptions& options) {
  const SourceInfo& info = open.info();
  const Result<std::int64_t> time = ChosenVolume("", info.times.count, options);
  const std::vector<FieldInfo> one(1);
  const Result<int> channel = ChosenChannel("", info.channels.empty() ? one : info.channels, options);
  return time.ok() && channel.ok() ? open.At(int(*time), *channel) : nullptr;
}

bool IsSame(const SourceInfo& info, const StoredAt& stored) {
  return info.version == stored.version && std::size_t(stored.level) < info.levels.size() &&
         info.levels[std::size_t(stored.level)].block == stored.block.end;
}

}  // namespace

Result<std::shared_ptr<VolumeSource>> OpenSource(const std::string& path, const ReadOptions& options, const SourceContext& context,
                                                 VolumeSource* beside) {
  if (std::shared_ptr<VolumeSource> at = beside != nullptr ? Beside(*beside, options) : nullptr; at != nullptr) return at;
  const bool magnitude = options.channel == kMagnitude;
  Result<std::shared_ptr<VolumeSource>> source = (magnitude ? OpenMagnitude : OpenValues)(path, options, context);
  if (source.ok() && options.hollow) return AsHollow(*std::move(source));
  if (source.ok() && options.labels) source = AsLabels(*std::move(source));
  return source;
}

Result<std::shared_ptr<VolumeSource>> OpenSameSource(const StoredAt& stored, const SourceContext& context) {
  if (NamesOwners(stored.source)) {
    Result<std::shared_ptr<VolumeSource>> source = OpenOwned(stored.source, context);
    return !source.ok() || IsSame((*source)->info(), stored) ? source
                                                             : Status::Unavailable("owners of another volume than the coordinator's");
  }
  Result<SourceText> text = ParseSourceText(stored.source);
  if (!text.ok()) return text.status();
  text->options.describe = true;
  Result<std::shared_ptr<VolumeSource>> source = OpenSource(text->path, text->options, context);
  if (!source.ok()) return source;
  return IsSame((*source)->info(), stored) ? source : Status::Unavailable(text->path + ": another one than the coordinator's");
}

std::shared_ptr<VolumeSource> SameSourceBeside(VolumeSource& beside, const std::string& text, const StoredAt& stored) {
  const auto place = [](const std::string& source) { return WithoutReadOption(AtTime(source, std::nullopt), "channel"); };
  Result<SourceText> wanted = ParseSourceText(stored.source);
  if (!IsSame(beside.info(), stored) || !wanted.ok() || place(text) != place(stored.source)) return nullptr;
  wanted->options.describe = true;
  return Beside(beside, wanted->options);
}

const SourceContext& ProcessReadContext() {
  static const SourceContext kContext = [] {
    const std::uint64_t said = process_memory;
    return std::make_shared<ReadContext>(LimitsFor(said > 0 ? said : std::uint64_t(std::max<std::int64_t>(AvailableMemoryBytes(), 0))));
  }();
  return kContext;
}

void SetReadMemory(std::uint64_t process_bytes) { process_memory = process_bytes; }

}  // namespace slabstream
