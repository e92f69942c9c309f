#include "client/cli/convert_source.h"

#include <fmt/format.h>

#include <utility>
#include <vector>

#include "client/cli/input_volume.h"
#include "client/cli/progress_display.h"
#include "data/open/any_volume.h"
#include "data/open/open_source.h"
#include "data/positional/slice_stream.h"
#include "data/sources/memory_source.h"
#include "data/sources/part_source.h"
#include "data/volume_io/read_progress.h"

namespace slabstream {
namespace {

Result<SourceToConvert> Open(const ConvertOptions& options, const SourceText& source, const ReadContext::Limits& limits, ProgressBar& bar) {
  if (IsReadInParts(source.path, source.options)) {
    Result<std::shared_ptr<VolumeSource>> opened = OpenSource(source.path, source.options, std::make_shared<ReadContext>(limits));
    if (!opened.ok()) return AsInput(opened.status());
    WarnOfPart(source.path, source.options, FileInfoOf((*opened)->info()));
    return SourceToConvert{*std::move(opened)};
  }
  if (!options.converts_part() && SliceStream::Recognises(source.path, source.options)) {
    const auto stream = SliceStream::Open(source.path, source.options, std::make_shared<ReadContext>(limits));
    if (!stream.ok()) return AsInput(stream.status());
    return SourceToConvert{*stream, SliceOrder{(*stream)->along(), (*stream)->from_end()}};
  }
  if (Status status = CheckInputVolume(source); !status.ok()) return status;
  Result<std::vector<std::string>> files = CheckVolumeHeaders(source.path, source.options);
  if (!files.ok()) return AsInput(files.status());
  ReadProgress reading([&](const ReadShare& read) { bar.Show(0.01 * read.percent, Describe(read, source.path)); });
  SourceText with_progress = source;
  with_progress.options.progress = &reading;
  const Result<LoadedVolume> loaded = ReadInputVolume(with_progress);
  if (!loaded.ok()) return loaded.status();
  const VolumeFileInfo& info = loaded->info;
  const std::uint64_t of_exact = loaded->exact == nullptr ? 0 : loaded->exact->bytes.size();
  return SourceToConvert{
      MakeMemorySource(loaded->volume,
                       {.format = info.format, .file_type = info.file_type, .labels = info.labels, .files = *std::move(files)},
                       loaded->exact),
      std::nullopt, std::uint64_t(info.description.voxel_bytes()) + of_exact};
}

}  // namespace

Result<SourceToConvert> OpenToConvert(const ConvertOptions& options, const SourceText& source, const ReadContext::Limits& limits,
                                      ProgressBar& bar) {
  Result<SourceToConvert> opened = Open(options, source, limits, bar);
  if (!opened.ok() || !options.converts_part()) return opened;
  const std::vector<SourceLevel>& levels = opened->source->info().levels;
  if (std::size_t(options.level) >= levels.size()) {
    return Status::InvalidArgument(
        levels.size() == 1 ? fmt::format("--level is {}, but '{}' has level 0 alone", options.level, source.path)
                           : fmt::format("--level is {}, but '{}' has levels 0 to {}", options.level, source.path, levels.size() - 1));
  }
  const Index3& size = levels[std::size_t(options.level)].description.geometry.size;
  Box box = options.box;
  for (const Axis axis : {Axis::kX, Axis::kY, Axis::kZ}) {
    if (box.end[axis] == 0) box.end[axis] = size[axis];
    if (box.begin[axis] < box.end[axis] && box.end[axis] <= size[axis]) continue;
    return Status::InvalidArgument(fmt::format("--box: {} from {} to {}, but level {} of '{}' has {} voxels there", Letter(axis),
                                               box.begin[axis], box.end[axis], options.level, source.path, size[axis]));
  }
  opened->source = MakePartSource(std::move(opened->source), options.level, box);
  return opened;
}

}  // namespace slabstream
