#include "worker/stored_voxels.h"

#include <fmt/format.h>

#include <map>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <tuple>
#include <utility>

#include "common/base/background_tasks.h"
#include "common/base/guarded.h"
#include "common/base/log.h"
#include "data/open/any_volume.h"
#include "data/open/open_source.h"

namespace slabstream {
namespace {

constexpr std::size_t kOpensAtOnce = 2;  // so one file system that does not answer leaves others alone

// The source if it is what the coordinator has. InvalidArgument: it is another one.
Result<std::shared_ptr<VolumeSource>> OpenSame(const StoredAt& stored) {
  const Result<SourceText> text = ParseSourceText(stored.source);
  if (!text.ok()) return text.status();
  Result<std::shared_ptr<VolumeSource>> source = OpenSource(text->path, text->options, ProcessReadContext());
  if (!source.ok()) return source;
  const SourceInfo& info = (*source)->info();
  const Result<std::uint64_t> version = VersionOf(info.files);
  if (!version.ok()) return version.status();
  const bool same = *version == stored.version && std::size_t(stored.level) < info.levels.size() &&
                    info.levels[std::size_t(stored.level)].block == stored.block.end;
  return same ? source : Status::InvalidArgument(text->path + ": another one than the coordinator's");
}

}  // namespace

struct StoredVoxels::Shared {
  using Piece = std::tuple<std::uint64_t, Box, std::uint32_t>;  // generation of the padded box; box and number of the chunk
  struct Place {                                                // of a source and version
    bool known = false;
    std::shared_ptr<VolumeSource> source = nullptr;  // null: it is not seen from here
  };

  std::mutex mutex;  // guards what follows
  std::function<void(WorkerEvent)> deliver;
  std::map<std::pair<std::string, std::uint64_t>, Place> places;
  std::set<Piece> reading;
  BackgroundTasks opening{kOpensAtOnce};

  void Find(const StoredAt& stored, const std::shared_ptr<Shared>& self) {
    opening.Post([self, stored] {
      Result<std::shared_ptr<VolumeSource>> source = Guarded("a source of voxels", [&] { return OpenSame(stored); });
      LogInfo(source.ok() ? "reads " + stored.source + " itself" : "asks the coordinator for voxels: " + source.status().message());
      const std::lock_guard lock(self->mutex);
      self->places[{stored.source, stored.version}] = {true, source.ok() ? *std::move(source) : nullptr};
    });
  }

  void End(const BoxKey& padded, const ChunkRequest& request, const Status& status) {
    WorkerEvent event = ChunkStored{padded, request.box, request.chunk, {}};
    if (!status.ok()) {
      event = MessageReceived{ChunkRefused{request.epoch, request.dataset, request.box, request.chunk, status}, {}};
    }
    const std::lock_guard lock(mutex);
    reading.erase({padded.generation, request.box, request.chunk});
    if (deliver) deliver(std::move(event));
  }
};

StoredVoxels::StoredVoxels(std::function<void(WorkerEvent)> deliver) : shared_(std::make_shared<Shared>()) {
  shared_->deliver = std::move(deliver);
}

StoredVoxels::~StoredVoxels() {
  const std::lock_guard lock(shared_->mutex);
  shared_->deliver = nullptr;
}

bool StoredVoxels::Read(const SendChunkRequest& wanted, const std::shared_ptr<StoredBox>& padded) {
  const ChunkRequest& request = wanted.request;
  const StoredAt& stored = *wanted.stored;
  if (request.chunk != 0) return false;  // not all samples of its box: BoxFetcher asks for none like that
  std::shared_ptr<VolumeSource> source;
  {
    const std::lock_guard lock(shared_->mutex);
    const auto [place, is_new] = shared_->places.try_emplace({stored.source, stored.version});
    if (is_new) shared_->Find(stored, shared_);
    if (place->second.source == nullptr) return false;
    if (!shared_->reading.insert({wanted.padded.generation, request.box, request.chunk}).second) return true;
    source = place->second.source;
  }
  const auto end = [shared = shared_, key = wanted.padded, request, padded, source](const Status& status) {
    shared->End(key, request, status);
  };
  const Status begun = Guarded("voxels of a box", [&] {
    if (const std::optional<BoxRoom> room = padded->RoomFor(request.box)) {
      source->Read(stored.level, request.box, *room, {}, end);
    } else {
      end(Status::Ok());
    }
    return Status::Ok();
  });
  if (!begun.ok()) end(begun);  // no memory
  return true;
}

}  // namespace slabstream
