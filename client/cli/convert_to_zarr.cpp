#include "client/cli/convert_parts.h"

#include <fmt/format.h>

#include <algorithm>
#include <iostream>

#include "client/cli/progress.h"
#include "data/open/read_volume.h"
#include "data/zarr_writer/ome_zarr_writer.h"

namespace slabstream {
namespace {

// Where the limit of the process goes.
struct Shares {
  ReadContext::Limits reading;
  std::uint64_t writing = 0;  // bytes
};

Shares Share(std::uint64_t memory, std::uint64_t volume_bytes) {
  constexpr std::uint64_t kProcess = std::uint64_t{48} << 20;  // its code, its threads
  const std::uint64_t taken = kProcess + memory / 4 + volume_bytes;
  return {{.under_way_bytes = memory / 8, .cache_bytes = memory / 8}, memory - std::min(memory, taken)};
}

}  // namespace

bool NamesZarr(const std::string& output) {
  std::string name = output;
  while (name.ends_with('/')) name.pop_back();
  return name.ends_with(".zarr");
}

Status ConvertToZarr(const ConvertOptions& options, const SourceText& source) {
  constexpr std::uint64_t kUsual = std::uint64_t{1} << 30;
  const std::uint64_t memory = options.memory > 0 ? options.memory : kUsual;
  ProgressBar bar(options.progress, 1);
  bar.Show(0, Describe(ReadShare{}, source.path));
  bool decodes = false;  // a volume that is read as a whole, before anything is written
  ReadProgress reading([&](const ReadShare& read) {
    if (decodes) bar.Show(0.01 * read.percent, Describe(read, source.path));
  });
  SourceText with_progress = source;
  with_progress.options.progress = &reading;
  const Result<SourceToConvert> opened = OpenToConvert(options, with_progress, Share(memory, 0).reading);
  if (!opened.ok()) return opened.status();
  decodes = opened->memory > 0;
  WarnOfPart(source.path, source.options, opened->source->info());
  const VolumeDescription& volume = opened->source->info().levels[0].description;
  const std::uint64_t held = options.memory > 0 ? opened->memory : 0;

  ByteProgress shown(bar, "writing " + options.output);
  const auto progress = [&](const OmeZarrProgress& now) { shown.Show(now.done_bytes, now.all_bytes); };
  const Status status = WriteOmeZarr(*opened->source, options.output,
                                     {.version = options.zarr_version,
                                      .slices = opened->source->info().slices,
                                      .memory = Share(memory, held).writing,
                                      .source = ShownSource(options.source),
                                      .stop = shown.stop(),
                                      .progress = progress});
  if (status.code() == StatusCode::kCancelled) {
    return Status::Cancelled(fmt::format("'{}': stopped at {} %; the same command goes on from there", options.output, shown.percent()));
  }
  if (status.code() == StatusCode::kInvalidArgument) return Status::InvalidArgument("OUTPUT " + status.message());
  if (!status.ok()) return status;
  const Index3& size = volume.geometry.size;
  bar.Clear();
  std::cout << fmt::format("wrote {}: OME-Zarr {}, {} x {} x {} voxels\n", options.output, ToString(options.zarr_version), size.x, size.y,
                           size.z);
  return Status::Ok();
}

}  // namespace slabstream
