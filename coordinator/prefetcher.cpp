#include "coordinator/prefetcher.h"

#include <deque>
#include <map>
#include <mutex>
#include <optional>
#include <set>
#include <stop_token>
#include <string>
#include <tuple>
#include <utility>

#include "common/base/guarded.h"
#include "common/base/log.h"
#include "common/base/url.h"
#include "data/open/open_source.h"
#include "data/stores/http_transfers.h"
#include "data/stores/object_cache.h"
#include "data/volume_io/read_options.h"

namespace slabstream {
namespace {

constexpr std::size_t kAtOnce = HttpTransfers::kMostOfAHost / 2;
constexpr std::size_t kMostWishes = 8, kMostSources = 8;
constexpr std::size_t kMostFetched = 1 << 16;  // blocks that are remembered

// Few threads and little memory: nothing is decoded.
SourceContext MakeContext() {
  return std::make_shared<ReadContext>(
      ReadContext::Limits{.decode_threads = 1, .under_way_bytes = std::uint64_t{32} << 20, .cache_bytes = 0, .only_keeps = true});
}

}  // namespace

struct Prefetcher::State : std::enable_shared_from_this<State> {
  using Place = std::pair<std::string, std::uint64_t>;  // a source, and its version
  struct Level {
    Place place;
    std::shared_ptr<VolumeSource> source;
    int number = 0;
  };
  struct Block {
    Level level;
    Box box;
    std::tuple<Place, int, Box> name() const { return {level.place, level.number, box}; }
  };
  struct Wish {
    Level level;
    std::deque<Box> blocks;
    Time until;
  };

  std::mutex mutex;  // guards what follows
  SourceContext context;
  std::map<Place, std::shared_ptr<VolumeSource>> sources;
  std::deque<Wish> wishes;                        // newest first
  std::set<std::tuple<Place, int, Box>> fetched;  // names; or under way
  std::size_t under_way = 0;
  bool fetching = false;  // a thread begins what is next
  std::stop_source stop;

  // The next block to fetch; none: nobody wants any, or enough are under way, and `fetching` ends.
  std::optional<Block> TakeNext() {
    const std::lock_guard lock(mutex);
    std::erase_if(wishes, [now = MonotonicNow()](const Wish& wish) { return wish.blocks.empty() || wish.until < now; });
    fetching = false;  // unless a block is found
    if (stop.stop_requested() || under_way == kAtOnce) return std::nullopt;
    for (Wish& wish : wishes) {
      while (!wish.blocks.empty()) {
        Block next{wish.level, wish.blocks.front()};
        wish.blocks.pop_front();
        if (fetched.size() >= kMostFetched) fetched.clear();
        if (!fetched.insert(next.name()).second) continue;
        ++under_way;
        fetching = true;
        return next;
      }
    }
    return std::nullopt;
  }

  void FetchNext() {
    {
      // A block that ends at once calls this again. The loop that is under way then begins the next one, so calls do not nest deeper and
      // deeper.
      const std::lock_guard lock(mutex);
      if (std::exchange(fetching, true)) return;
    }
    while (const std::optional<Block> next = TakeNext()) {
      const Level& level = next->level;
      const ScalarType type = level.source->info().levels[std::size_t(level.number)].description.type;
      const Status begun = Guarded("fetching ahead", [&] {
        // Nothing is decoded, so what comes is the value of chunks that are not there.
        const auto unused = std::make_shared<std::vector<std::byte>>(std::size_t(next->box.voxel_count()) * BytesPerSample(type));
        const auto done = [self = shared_from_this(), unused, next = *next](const Status& status) { self->End(next, status); };
        level.source->Read(level.number, next->box, *unused, stop.get_token(), done);
        return Status::Ok();
      });
      if (!begun.ok()) End(*next, begun);
    }
  }

  void End(const Block& ended, const Status& status) {
    {
      const std::lock_guard lock(mutex);
      --under_way;
      if (!status.ok()) {  // frames that need it say what is wrong
        fetched.erase(ended.name());
        std::erase_if(wishes, [&](const Wish& wish) { return wish.level.place == ended.level.place; });
        sources.erase(ended.level.place);
      }
    }
    if (!status.ok()) LogDebug("fetches nothing ahead: " + status.message());
    FetchNext();
  }

  Result<std::shared_ptr<VolumeSource>> SourceAt(const StoredAt& stored) {
    const Place place{stored.source, stored.version};
    SourceContext of_sources;
    {
      const std::lock_guard lock(mutex);
      if (const auto found = sources.find(place); found != sources.end()) return found->second;
      if (context == nullptr) context = MakeContext();
      of_sources = context;
    }
    Result<std::shared_ptr<VolumeSource>> source = OpenSameSource(stored, of_sources);
    if (!source.ok()) return source;
    const std::lock_guard lock(mutex);
    if (sources.size() >= kMostSources) sources.clear();
    sources.try_emplace(place, *source);
    return source;
  }
};

Prefetcher::Prefetcher() : state_(std::make_shared<State>()) {}
Prefetcher::~Prefetcher() { state_->stop.request_stop(); }

bool Prefetcher::Fetches(const StoredAt& stored) {
  const Result<SourceText> text = ParseSourceText(stored.source);
  return text.ok() && IsUrl(text->path) && ProcessObjectCache() != nullptr;
}

Status Prefetcher::Fetch(const StoredAt& stored, std::vector<Box> blocks) {
  Result<std::shared_ptr<VolumeSource>> source = state_->SourceAt(stored);
  if (!source.ok()) return source.status();
  {
    const std::lock_guard lock(state_->mutex);
    state_->wishes.push_front(
        {{{stored.source, stored.version}, *std::move(source), stored.level}, {blocks.begin(), blocks.end()}, MonotonicNow() + kLasts});
    if (state_->wishes.size() > kMostWishes) state_->wishes.pop_back();
  }
  state_->FetchNext();
  return Status::Ok();
}

}  // namespace slabstream
