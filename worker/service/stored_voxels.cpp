#include "worker/service/stored_voxels.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <tuple>
#include <utility>

#include "common/base/log.h"
#include "common/text/url.h"
#include "common/threads/background_tasks.h"
#include "common/threads/guarded.h"
#include "data/open/open_source.h"
#include "data/owned/owned_source.h"

namespace slabstream {
namespace {

constexpr std::size_t kOpensAtOnce = 2;      // so one file system that does not answer leaves others alone
constexpr std::size_t kFarOpensAtOnce = 64;  // behind addresses; so many servers that do not answer leave others alone

}  // namespace

struct StoredVoxels::Shared {
  using Piece = std::tuple<std::uint64_t, Box, std::uint32_t>;  // generation of the padded box; box and number of the chunk
  using PlaceName = std::pair<std::string, std::uint64_t>;      // a source, and its version
  struct Place {
    bool looking = false;                            // at it, just now
    Time looked;                                     // the last time
    Time used;                                       // likewise
    std::shared_ptr<VolumeSource> source = nullptr;  // null: it is not seen from here, as far as is known
  };

  std::mutex mutex;  // guards what follows
  std::function<void(WorkerEvent)> deliver;
  std::map<PlaceName, Place> places;
  Time asked;  // the last time that one was asked for
  std::set<Piece> reading;
  BackgroundTasks opening{kOpensAtOnce}, opening_far{kFarOpensAtOnce};

  // The source at this place; null: it is not seen from here, or not known to be, and looked for if it is time. Called with the mutex.
  std::shared_ptr<VolumeSource> SourceAt(const StoredAt& stored, Time now, const std::shared_ptr<Shared>& self) {
    const auto [found, is_new] = places.try_emplace({stored.source, stored.version});
    Place& place = found->second;
    place.used = asked = now;
    if (is_new) place.source = AtOnce(stored);
    if (place.source == nullptr && !place.looking && !NamesOwners(stored.source) && (is_new || now >= place.looked + kLookAgain)) {
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

  // What is opened without waiting, or null. Called with the mutex.
  std::shared_ptr<VolumeSource> AtOnce(const StoredAt& stored) const {
    if (!NamesOwners(stored.source)) return Beside(stored);
    const Result<std::shared_ptr<VolumeSource>> source = OpenSameSource(stored, ProcessReadContext());
    return source.ok() ? *source : nullptr;
  }

  // Another time or channel of what is open: to open it behind an address takes several requests, one after the other. Called with the
  // mutex.
  std::shared_ptr<VolumeSource> Beside(const StoredAt& stored) const {
    if (SchemeOf(stored.source).empty()) return nullptr;
    for (const auto& [name, place] : places) {
      if (place.source == nullptr) continue;
      if (std::shared_ptr<VolumeSource> source = SameSourceBeside(*place.source, name.first, stored)) return source;
    }
    return nullptr;
  }

  void Find(const StoredAt& stored, const std::shared_ptr<Shared>& self) {
    (SchemeOf(stored.source).empty() ? opening : opening_far).Post([self, stored] {
      Result<std::shared_ptr<VolumeSource>> source = Guarded("a source of voxels", [&] {
        std::unique_lock lock(self->mutex);
        std::shared_ptr<VolumeSource> beside = self->Beside(stored);  // opened while this waited for its turn
        lock.unlock();
        return beside != nullptr ? Result(std::move(beside)) : OpenSameSource(stored, ProcessReadContext());
      });
      LogInfo(source.ok() ? "reads " + stored.source + " itself" : "asks the coordinator for voxels: " + source.status().message());
      const std::lock_guard lock(self->mutex);
      Place& place = self->places[{stored.source, stored.version}];  // others may have come for it meanwhile, which it may stand beside
      place.looking = false;
      place.used = self->asked;
      if (source.ok()) place.source = *std::move(source);
    });
  }

  // A read from there has failed: the coordinator may see what is not seen from here any more.
  void Lose(const PlaceName& name) {
    const std::lock_guard lock(mutex);
    if (const auto place = places.find(name); place != places.end()) place->second.source = nullptr;
  }

  void End(const SendChunkRequest& wanted, VolumeSource& source, const Status& status) {
    const ChunkRequest& request = wanted.request;
    WorkerEvent event = ChunkStored{wanted.padded, request.box, request.chunk, {}, status.ok() ? source.TakeStoredBytes() : 0};
    // What was dropped is asked for again.
    const bool dropped = source.info().on_demand && status.code() == StatusCode::kUnavailable;
    if (dropped) {
      event = ChunkStored{wanted.padded, request.box, request.chunk, status};
    } else if (status.code() == StatusCode::kUnavailable) {
      Lose({wanted.stored->source, wanted.stored->version});
    }
    if (!status.ok() && !dropped) {
      event = MessageReceived{ChunkRefused{request.epoch, request.dataset, request.box, request.chunk, status}, {}};
    }
    const std::lock_guard lock(mutex);
    reading.erase({wanted.padded.generation, request.box, request.chunk});
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

bool StoredVoxels::Read(SendChunkRequest& wanted, const std::shared_ptr<StoredBox>& padded, Time now) {
  const ChunkRequest& request = wanted.request;
  const StoredAt& stored = *wanted.stored;
  const bool may_ask = std::exchange(wanted.request.in_place, false);
  if (request.chunk != 0) return false;  // not all samples of its box: BoxFetcher asks for none like that
  std::shared_ptr<VolumeSource> source;
  {
    const std::lock_guard lock(shared_->mutex);
    source = shared_->SourceAt(stored, now, shared_);
    const VoxelReach reach = source == nullptr ? VoxelReach::kNever : source->Reaches(stored.level, request.box);
    wanted.request.in_place = may_ask && reach == VoxelReach::kOnceMade;
    if (reach != VoxelReach::kNow) return false;
    if (!shared_->reading.insert({wanted.padded.generation, request.box, request.chunk}).second) return true;
  }
  const auto end = [shared = shared_, wanted, padded, source](const Status& status) { shared->End(wanted, *source, status); };
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
