#include "worker/stored_voxels.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <mutex>
#include <string>
#include <tuple>
#include <utility>

#include "common/base/background_tasks.h"
#include "common/base/guarded.h"
#include "common/base/log.h"
#include "common/wire/payload.h"
#include "data/open/any_volume.h"
#include "data/open/open_source.h"
#include "data/sources/read_part.h"

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
  const bool same = info.version == stored.version && std::size_t(stored.level) < info.levels.size() &&
                    info.levels[std::size_t(stored.level)].block == stored.block.end;
  return same ? source : Status::InvalidArgument(text->path + ": another one than the coordinator's");
}

}  // namespace

struct StoredVoxels::Shared {
  using ChunkName = std::tuple<DatasetId, Box, std::uint32_t>;
  using PlaceName = std::pair<std::string, std::uint64_t>;  // a source, and its version
  struct Place {
    bool looking = false;                            // at it, just now
    Time looked;                                     // the last time
    Time used;                                       // likewise
    std::shared_ptr<VolumeSource> source = nullptr;  // null: it is not seen from here, as far as is known
  };

  std::mutex mutex;  // guards what follows
  std::function<void(MessageReceived)> deliver;
  std::map<PlaceName, Place> places;
  std::map<ChunkName, int> reading;  // how often each was asked for: two boxes may need the same voxels
  BackgroundTasks opening{kOpensAtOnce};

  // The source at this place; null: it is not seen from here, or not known to be, and looked for if it is time. Called with the mutex.
  std::shared_ptr<VolumeSource> SourceAt(const StoredAt& stored, Time now, const std::shared_ptr<Shared>& self) {
    const auto [found, is_new] = places.try_emplace({stored.source, stored.version});
    Place& place = found->second;
    place.used = now;
    if (place.source == nullptr && !place.looking && (is_new || now >= place.looked + kLookAgain)) {
      place.looking = true;
      place.looked = now;
      Find(stored, self);
    }
    const std::shared_ptr<VolumeSource> source = place.source;
    if (places.size() > kMostPlaces) {
      places.erase(std::ranges::min_element(places, {}, [](const auto& each) { return each.second.used; }));
    }
    return source;
  }

  void Find(const StoredAt& stored, const std::shared_ptr<Shared>& self) {
    opening.Post([self, stored] {
      Result<std::shared_ptr<VolumeSource>> source = Guarded("a source of voxels", [&] { return OpenSame(stored); });
      LogInfo(source.ok() ? "reads " + stored.source + " itself" : "asks the coordinator for voxels: " + source.status().message());
      const std::lock_guard lock(self->mutex);
      const auto place = self->places.find({stored.source, stored.version});
      if (place == self->places.end()) return;  // dropped meanwhile
      place->second.looking = false;
      if (source.ok()) place->second.source = *std::move(source);
    });
  }

  // A read from there has failed: the coordinator may see what is not seen from here any more.
  void Lose(const PlaceName& name) {
    const std::lock_guard lock(mutex);
    if (const auto place = places.find(name); place != places.end()) place->second.source = nullptr;
  }

  void Deliver(const ChunkRequest& request, VolumeSource& source, Result<Bytes> samples) {
    MessageReceived message;
    const Status packed = Guarded("a chunk of voxels", [&] {
      if (!samples.ok()) return samples.status();
      Chunk chunk{.epoch = request.epoch, .dataset = request.dataset, .box = request.box, .chunk = request.chunk};
      chunk.stored_bytes = source.TakeStoredBytes();
      message.payload = PackChunk(*std::move(samples), Codec::kRaw, chunk);
      message.message = chunk;
      return Status::Ok();
    });
    if (!packed.ok()) message.message = ChunkRefused{request.epoch, request.dataset, request.box, request.chunk, packed};
    const std::lock_guard lock(mutex);
    const auto asked = reading.extract({request.dataset, request.box, request.chunk});
    for (int i = 0; deliver && i < asked.mapped(); ++i) {
      deliver(message);
      if (auto* chunk = std::get_if<Chunk>(&message.message)) chunk->stored_bytes = 0;  // told once
    }
  }
};

StoredVoxels::StoredVoxels(std::function<void(MessageReceived)> deliver) : shared_(std::make_shared<Shared>()) {
  shared_->deliver = std::move(deliver);
}

StoredVoxels::~StoredVoxels() {
  const std::lock_guard lock(shared_->mutex);
  shared_->deliver = nullptr;
}

bool StoredVoxels::Read(const ChunkRequest& request, const StoredAt& stored, Time now) {
  std::shared_ptr<VolumeSource> source;
  {
    const std::lock_guard lock(shared_->mutex);
    source = shared_->SourceAt(stored, now, shared_);
    if (source == nullptr) return false;
    if (++shared_->reading[{request.dataset, request.box, request.chunk}] > 1) return true;
  }
  const ChunkPart part = PartOfChunk(request.box, source->info().levels[std::size_t(stored.level)].description.type, request.chunk);
  ReadPart(source, stored.level, request.box, part.begin, part.bytes,
           [shared = shared_, request, source, name = Shared::PlaceName(stored.source, stored.version)](Result<Bytes> samples) {
             if (samples.status().code() == StatusCode::kUnavailable) shared->Lose(name);
             shared->Deliver(request, *source, std::move(samples));
           });
  return true;
}

}  // namespace slabstream
