#include "data/brick_store/brick_store.h"

#include <fmt/format.h>
#include <xxhash.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <filesystem>
#include <utility>

#include "common/base/log.h"
#include "common/base/printable.h"
#include "common/volume/memory_budget.h"
#include "data/open/open_source.h"
#include "data/open/unchanged_source.h"
#include "data/survey/survey.h"
#include "data/zarr_writer/ome_zarr_writer.h"

namespace slabstream {
namespace {

namespace fs = std::filesystem;

// The description of the stream, and the voxels of the store, which is in use meanwhile.
class StoredSource : public DescribedSource {
 public:
  StoredSource(SourceInfo info, std::shared_ptr<VolumeSource> bricks, StoreFolder::Lock in_use)
      : DescribedSource(std::move(bricks), std::move(info)), in_use_(std::move(in_use)) {}

 private:
  const StoreFolder::Lock in_use_;
};

// "scan-5f3a...": the beginning is for people.
Result<std::string> NameOf(const SourceText& text, const std::string& source, const SourceInfo& stream) {
  constexpr int kLayout = 2;  // to be raised when stores are written otherwise
  constexpr std::size_t kMostOfStem = 40;
  const Result<std::uint64_t> version = VersionOf(stream.files);
  if (!version.ok()) return version.status();
  std::error_code error;
  const fs::path path = fs::weakly_canonical(text.path, error);
  const std::string identity = fmt::format("{} {} {} {}", kLayout, path.string(), source.substr(text.path.size()), *version);
  std::string stem = path.stem().stem().string().substr(0, kMostOfStem);
  std::ranges::replace_if(
      stem, [](unsigned char c) { return std::isalnum(c) == 0; }, '_');
  return fmt::format("{}-{:016x}", stem, XXH3_64bits(identity.data(), identity.size()));
}

Result<StoredStream> OpenStore(const std::string& path, SourceInfo stream, const SourceContext& context, StoreFolder::Lock lock) {
  Result<std::shared_ptr<VolumeSource>> bricks = OpenSource(path, {}, context);
  if (!bricks.ok()) return bricks.status();
  const VolumeDescription whole = stream.levels.front().description;
  stream.levels = (*bricks)->info().levels;
  stream.slices.reset();
  stream.version = (*bricks)->info().version;  // of what workers find there
  const VolumeDescription& stored = stream.levels.front().description;
  if (stored.type != whole.type || stored.geometry.size != whole.geometry.size) {
    return Status::DataLoss(fmt::format("'{}' is damaged: remove it", path));
  }
  // Levels are those of even grids.
  if (whole.voxel_bytes() <= kExactBytes || whole.geometry.rectilinear()) stream.levels.resize(1);
  // The numbers of the file itself, before a writer has rounded them.
  stream.levels.front().description = whole;
  for (SourceLevel& level : stream.levels) level.description.mapping = whole.mapping;
  stream.files.push_back(path);  // if somebody removes it, its voxels are not those of the volume any more
  return StoredStream{std::make_shared<StoredSource>(std::move(stream), *std::move(bricks), std::move(lock)), path};
}

// Writes the store; whoever calls holds it alone.
class StoreWriter {
 public:
  StoreWriter(const StoreFolder& stores, std::string name, std::string file, VolumeSource& stream, const BrickStoreOptions& options)
      : stores_(stores), name_(std::move(name)), file_(std::move(file)), stream_(stream), options_(options) {}

  Status Write(const StoreFolder::Lock& alone) {
    // A compressed file tells best how well its voxels can be packed.
    std::error_code error;
    const std::uint64_t least = fs::file_size(stream_.info().files.back(), error);
    stores_.MakeRoom(name_, least);
    if (stores_.RoomFor(name_) < least) return Full(least, "");
    Result<OmeZarrOptions> layout = Layout();
    if (!layout.ok()) return layout.status();
    Status status = WriteWithin(*layout, alone);
    if (status.code() == StatusCode::kInvalidArgument) {  // what is there was begun otherwise
      fs::remove_all(stores_.PathOf(name_), error);
      status = WriteWithin(*layout, alone);
    }
    if (status.ok()) status = stores_.Seal(name_);
    if (!status.ok() && status.code() != StatusCode::kCancelled) stores_.Remove(name_);
    return status;
  }

  // What is missing is told, and where.
  Status Full(std::uint64_t needed, const std::string& why) const {
    return Status::Unavailable(Printable(
        fmt::format("'{}' cannot hold the voxels of '{}': they need about {}, {} are available{}; $XDG_CACHE_HOME names another place",
                    stores_.path(), file_, MemoryText(needed), MemoryText(stores_.RoomFor(name_)), why.empty() ? "" : " (" + why + ")")));
  }

 private:
  // Slabs as thick as memory allows. The levels are the same, however thick.
  Result<OmeZarrOptions> Layout() const {
    constexpr std::array<std::int32_t, 4> kChunkSides = {64, 32, 16, 8};
    OmeZarrOptions layout{.slices = stream_.info().slices,
                          .coarsest_side = kChunkSides.front(),
                          .codec_level = 1,  // twice as fast as the usual one, and little larger
                          .memory = options_.memory,
                          .source = file_};
    std::uint64_t least = 0;
    for (const std::int32_t side : kChunkSides) {
      layout.chunk_side = side;
      least = LeastMemoryFor(stream_.info(), layout);
      if (least <= layout.memory) return layout;
    }
    return Status::ResourceExhausted(fmt::format("{}: to read its slices once needs {} of memory, but only {} are given to it", file_,
                                                 MemoryText(least), MemoryText(layout.memory)));
  }

  Status WriteWithin(OmeZarrOptions layout, const StoreFolder::Lock& alone) {
    if (Status begun = stores_.Begin(name_); !begun.ok()) return begun;
    std::stop_source stop;
    const std::stop_callback passed_on(options_.stop, [&] { stop.request_stop(); });
    layout.stop = stop.get_token();
    bool full = false;
    std::uint64_t written = 0;
    double share = 0;
    layout.progress = [&](const OmeZarrProgress& progress) {
      TouchLock(alone);
      written = stores_.BytesOf(name_);
      share = double(progress.done_bytes) / double(progress.all_bytes);
      const std::uint64_t room = stores_.RoomFor(name_);
      if (written <= room) return;
      stores_.MakeRoom(name_, written);
      full = stores_.RoomFor(name_) < written;
      if (full) stop.request_stop();
    };
    const Status status = WriteOmeZarr(stream_, stores_.PathOf(name_), layout);
    // As it went so far.
    const auto needed = [&] {
      return share > 0 ? std::uint64_t(double(written) / share) : std::uint64_t(stream_.info().levels[0].description.voxel_bytes());
    };
    if (full) return Full(needed(), "");
    return status.code() == StatusCode::kUnavailable ? Full(needed(), status.message()) : status;
  }

  const StoreFolder& stores_;
  const std::string name_, file_;
  VolumeSource& stream_;
  const BrickStoreOptions& options_;
};

}  // namespace

Result<StoredStream> OpenStored(const std::string& source, const StoreFolder& stores, const SourceContext& context,
                                const BrickStoreOptions& options, ReadProgress* progress) {
  Result<SourceText> text = ParseSourceText(source);
  if (!text.ok()) return text.status();
  text->options.progress = progress;
  text->options.describe = true;
  const Result<std::shared_ptr<VolumeSource>> stream = OpenSource(text->path, text->options, context);
  if (!stream.ok()) return stream.status();
  const SourceInfo& info = (*stream)->info();
  if (!info.slices) return Status::InvalidArgument(text->path + ": is no compressed stream");
  const Result<std::string> name = NameOf(*text, source, info);
  if (!name.ok()) return name.status();
  StoreWriter writer(stores, *name, text->path, **stream, options);
  while (true) {
    Result<StoreFolder::Lock> in_use = stores.LockShared(*name, options.stop);
    if (!in_use.ok()) return Status(in_use.status().code(), text->path + ": " + in_use.status().message());
    if (stores.IsWhole(*name)) return OpenStore(stores.PathOf(*name), info, context, *std::move(in_use));
    ::close(in_use->Release());
    const Result<StoreFolder::Lock> alone = stores.LockAlone(*name, options.stop);
    if (!alone.ok()) return Status(alone.status().code(), text->path + ": " + alone.status().message());
    if (stores.IsWhole(*name)) continue;  // another one has written it meanwhile
    LogInfo(fmt::format("reads {} into '{}'", text->path, stores.PathOf(*name)));
    if (Status status = writer.Write(*alone); !status.ok()) return status;
  }
}

}  // namespace slabstream
