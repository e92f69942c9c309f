#include <fmt/format.h>

#include <algorithm>
#include <iostream>
#include <memory>
#include <optional>
#include <utility>

#include "client/cli/commands.h"
#include "client/cli/input_volume.h"
#include "client/cli/progress.h"
#include "common/files/store_folder.h"
#include "common/volume/memory_budget.h"
#include "data/catalogue/catalogue.h"
#include "data/open/open_source.h"
#include "data/open/unchanged_source.h"
#include "data/stores/object_cache.h"
#include "data/survey/index_file.h"
#include "data/survey/make_index.h"
#include "data/volume_io/formats.h"

namespace slabstream {
namespace {

constexpr std::uint64_t kUsualMemory = std::uint64_t{1} << 30;

Result<std::shared_ptr<VolumeSource>> Open(const SourceText& source, std::uint64_t memory) {
  const Result<std::shared_ptr<VolumeSource>> opened =
      OpenSource(source.path, source.options,
                 std::make_shared<ReadContext>(ReadContext::Limits{.under_way_bytes = memory / 8, .cache_bytes = memory / 8}));
  if (!opened.ok()) return opened.status();
  return opened;
}

// What is known already of the files as they are.
Result<BrickIndex> Begun(const IndexFile& file, const std::string& name, const SourceInfo& info) {
  Result<std::optional<BrickIndex>> known = file.Read(name, info);
  if (known.ok() && *known) return **std::move(known);
  return EmptyIndex(info);  // none, or that of other files, or a damaged one: it is replaced
}

bool IsGrid(const SourceText& source) {
  const VolumeFormat* const format = FindFormat(source.path, source.options);
  return format != nullptr && std::ranges::find(format->options, "lattice") != format->options.end();
}

// A grid has no index, but its cells in order on disk.
Status KeepCells(const IndexingOptions& options, SourceText source, std::uint64_t memory) {
  ProgressBar bar(options.progress, 1);
  ReadProgress progress([&](const ReadShare& read) {
    bar.Show(read.percent / 100.0, fmt::format("sorting the cells of {}: {} %", source.path, read.percent));
  });
  source.options.headers_only = false;
  source.options.keep_cells = true;
  source.options.progress = &progress;
  const Result<StoreFolder> folder = StoreFolder::Usual();
  if (!folder.ok()) return folder.status();
  const Result<std::shared_ptr<VolumeSource>> opened = Open(source, memory);
  if (!opened.ok()) return opened.status();
  bar.Clear();
  std::cout << fmt::format("keeps the cells of {} in {}\n", options.source, folder->path());
  return Status::Ok();
}

}  // namespace

Status RunIndex(const IndexingOptions& options) {
  if (Status kept = KeepObjects(options.cache); !kept.ok()) return kept;
  Result<SourceText> source = ParseSourceText(options.source);
  if (!source.ok()) return source.status();
  source->options.describe = true;  // as the pictures do that read the index
  source->options.headers_only = true;
  if (Status status = CheckInputVolume(*source); !status.ok()) return status;
  const std::uint64_t memory = options.memory > 0 ? options.memory : kUsualMemory;
  LimitMemory(memory);
  if (IsGrid(*source)) return KeepCells(options, *std::move(source), memory);
  const Result<std::shared_ptr<VolumeSource>> opened = Open(*source, memory);
  if (!opened.ok()) return opened.status();
  const SourceInfo& info = (*opened)->info();
  if (!info.in_parts()) {
    return Status::InvalidArgument(
        fmt::format("SOURCE '{}' can have no index: its format cannot be read in parts; `slabstream convert` writes an OME-Zarr, which can",
                    options.source));
  }
  const Result<IndexFile> file = IndexFileOf(options.source);
  if (!file.ok()) return file.status();
  const auto name_now = [&]() -> Result<std::string> {
    const Result<std::uint64_t> version = VersionOf(info.files);
    return version.ok() ? file->NameNow(*version, info) : version.status();
  };
  const Result<std::string> name = name_now();
  if (!name.ok()) return name.status();
  Result<BrickIndex> index = Begun(*file, *name, info);
  if (!index.ok()) return index.status();

  ProgressBar bar(options.progress, 1);
  ByteProgress shown(bar, "reading " + source->path);
  const auto progress = [&](const IndexProgress& now) { shown.Show(now.done_bytes, now.all_bytes); };
  const Status read = ReadIntoIndex(**opened, {.memory = memory / 4, .stop = shown.stop(), .progress = progress}, *index);
  // What was read until an error or Ctrl-C is worth keeping, unless the files are not those that were read.
  const Result<std::string> name_then = name_now();
  if (!name_then.ok() || *name_then != *name) {
    return Status::Unavailable(options.source + ": the files have changed while they were read; the same command reads them again");
  }
  if (Status written = file->Merge(*name, *index, info); !written.ok()) return written;
  if (read.code() == StatusCode::kCancelled) {
    return Status::Cancelled(fmt::format("'{}': stopped at {} %; the same command goes on from there", options.source, shown.percent()));
  }
  if (!read.ok()) return read;
  std::size_t bricks = 0;
  for (const BrickRangeList& level : index->levels) bricks += level.size();
  bar.Clear();
  std::cout << fmt::format("wrote {}: ranges of {} bricks, {:.1f} KiB\n", file->path(), bricks,
                           double(file->facts().value_or(IndexFile::Facts{}).bytes) / 1024);
  return Status::Ok();
}

}  // namespace slabstream
