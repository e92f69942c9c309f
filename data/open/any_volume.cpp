#include "data/open/any_volume.h"

#include <algorithm>
#include <atomic>
#include <memory>
#include <utility>

#include "common/base/log.h"
#include "common/text/url.h"
#include "common/volume/memory_budget.h"
#include "data/open/open_source.h"
#include "data/positional/slice_stream.h"
#include "data/survey/survey.h"
#include "data/volume_io/exact_samples.h"
#include "data/volume_io/file_parts.h"
#include "data/volume_io/formats.h"

namespace slabstream {
namespace {

// A quarter of it, at most 128 MiB, for chunks under way, the rest for those that may be needed again. A small level, of which a survey
// from afar reads all, is then read once more by who holds it.
ReadContext::Limits LimitsFor(std::uint64_t process_bytes) {
  constexpr std::uint64_t kLeast = 8U << 20, kMostUnderWay = 128U << 20;
  const std::uint64_t all = std::max(SourceBytes(process_bytes), 2 * kLeast), under_way = std::clamp(all / 4, kLeast, kMostUnderWay);
  return {.under_way_bytes = under_way, .cache_bytes = all - under_way, .small_bytes = std::uint64_t(kFarSurvey.exact)};
}

std::atomic<std::uint64_t> process_memory = 0;  // 0: not said

}  // namespace

const SourceContext& ProcessReadContext() {
  static const SourceContext kContext = [] {
    const std::uint64_t said = process_memory;
    return std::make_shared<ReadContext>(LimitsFor(said > 0 ? said : std::uint64_t(std::max<std::int64_t>(AvailableMemoryBytes(), 0))));
  }();
  return kContext;
}

void SetReadMemory(std::uint64_t process_bytes) { process_memory = process_bytes; }

VolumeFileInfo FileInfoOf(const SourceInfo& source) {
  const VolumeDescription& finest = source.levels.front().description;
  return {.description = finest,
          .file_type = source.file_type,
          .format = source.format,
          .stored_size = finest.geometry.size,
          .steps = StepsOf(finest.geometry.spacing),
          .labels = source.labels,
          .looks = source.looks,
          .channels = source.channels,
          .channel = source.channel,
          .times = source.times,
          .time = source.time,
          .notes = source.notes};
}

namespace {

FileParts PartsBy(const VolumeFileInfo& info) {
  return {.times = info.times, .time = info.time, .channels = info.channels, .channel = info.channel};
}

}  // namespace

void WarnOfPart(const std::string& path, const ReadOptions& options, const VolumeFileInfo& info) {
  for (const std::string& text : ShownTexts(path, PartsBy(info), options)) LogWarning(text);
}

Result<std::vector<std::string>> TextsOfPart(const std::string& path, const ReadOptions& options) {
  if (IsReadWhole(path, options)) {
    const Result<FileParts> parts = PartsOf(path, options);
    return parts.ok() ? Result(ShownTexts(path, *parts, options)) : parts.status();
  }
  const Result<std::shared_ptr<VolumeSource>> source = OpenSource(path, options, ProcessReadContext());
  return source.ok() ? Result(ShownTexts(path, PartsBy(FileInfoOf((*source)->info())), options)) : source.status();
}

bool IsReadWhole(const std::string& path, const ReadOptions& options) {
  return !IsUrl(path) && (FindFormat(path, options) != nullptr || FindSourceFormat(path, options) == nullptr);
}

Result<LoadedVolume> ReadAnyVolume(const std::string& path, const ReadOptions& options) {
  if (!IsReadWhole(path, options)) {
    const Result<std::shared_ptr<VolumeSource>> source = OpenSource(path, options, ProcessReadContext());
    return source.ok() ? ReadFinest(**source, path, options) : source.status();
  }
  Result<LoadedVolume> loaded = ReadVolume(path, options);
  if (loaded.ok()) WarnOfPart(path, options, loaded->info);
  return loaded;
}

Result<LoadedVolume> ReadFinest(VolumeSource& source, const std::string& path, const ReadOptions& options) {
  Result<LevelInMemory> level = ReadLevel(source, 0, options.progress);
  if (!level.ok()) return level.status();
  LoadedVolume loaded{FileInfoOf(source.info()), std::move(level->volume), std::move(level->exact)};
  loaded.rounded = loaded.exact != nullptr;
  WarnOfPart(path, options, loaded.info);
  return loaded;
}

void PrepareToShow(const std::string& path, LoadedVolume& loaded) {
  if (loaded.rounded) LogWarning(path + ": " + RoundingText(loaded.exact->of.type, loaded.exact.get()));
  if (!loaded.rounded || !MayRoundLabels(loaded.exact->of.type)) loaded.exact = nullptr;
}

Result<std::vector<std::string>> CheckAnyVolumeHeaders(const std::string& path, const ReadOptions& options) {
  if (IsReadWhole(path, options)) {
    Result<std::vector<std::string>> files = CheckVolumeHeaders(path, options);
    if (files.status().code() != StatusCode::kResourceExhausted) return files;
    // Too large to be held, but perhaps not to be read.
    if (SliceStream::Recognises(path, options)) {
      const Result<std::shared_ptr<SliceStream>> stream = SliceStream::Open(path, options, nullptr);
      if (!stream.ok()) return stream.status();
      return (*stream)->info().files;
    }
    if (!IsReadInParts(path, options)) return files;
  }
  const Result<std::shared_ptr<VolumeSource>> source = OpenSource(path, options, ProcessReadContext());
  if (!source.ok()) return source.status();
  return (*source)->info().files;
}

Status CheckAnyVolume(const std::string& path, const ReadOptions& options) {
  return IsReadWhole(path, options) ? CheckVolume(path, options) : Status::Ok();
}

bool LooksLikeAnyVolume(const std::string& path) { return CheckAnyVolume(path).ok(); }

}  // namespace slabstream
