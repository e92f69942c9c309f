#include "data/sources/read_context.h"

#include <algorithm>
#include <deque>
#include <map>
#include <mutex>
#include <thread>
#include <utility>

#include "common/text/url.h"
#include "common/threads/background_tasks.h"

namespace slabstream {

std::string ServerOf(std::string_view source) {
  if (SchemeOf(source).empty()) return {};
  if (const std::size_t endpoint = source.find(kEndpointMark); endpoint != std::string_view::npos) {
    source.remove_prefix(endpoint + kEndpointMark.size());
  }
  while (!SchemeOf(source).empty()) source.remove_prefix(SchemeOf(source).size() + 3);
  return std::string(source.substr(0, source.find('/')));
}

struct ReadContext::State {
  explicit State(const Limits& l)
      : limits(l),
        decode_threads(l.decode_threads > 0 ? l.decode_threads : std::max<std::size_t>(1, std::thread::hardware_concurrency())),
        decoders(decode_threads),
        cache(l.cache_bytes) {}

  struct Waiting {
    std::uint64_t bytes = 0;
    std::function<void()> task;
  };

  // What reads of one server, or of files, may wait for.
  struct Lane {
    std::size_t tasks = 0;        // that were begun and not released
    std::uint64_t under_way = 0;  // their bytes
    std::deque<Waiting> waiting;
  };

  // A server leaves others a quarter of what those before it have left. What comes first of each hardly waits: a server that does not
  // answer has promised bytes, but sent none.
  bool Fits(const std::string& server, const Lane& lane, std::uint64_t bytes) const {
    const std::uint64_t own = lane.under_way + bytes, others = far_bytes - lane.under_way, most = limits.under_way_bytes;
    if (lane.tasks >= most_tasks) return false;
    if (server.empty()) return lane.tasks == 0 || own <= most;
    return lane.tasks == 0 ? others == 0 || others + bytes <= 2 * most : own <= (most - std::min(others, most)) / 4 * 3;
  }
  void Begin(const std::string& server, Lane& lane, std::uint64_t bytes) {
    ++lane.tasks;
    lane.under_way += bytes;
    if (!server.empty()) far_bytes += bytes;
  }

  const Limits limits;
  const std::size_t decode_threads;
  const std::size_t most_tasks = kMostAsked + 2 * decode_threads;
  std::mutex post_mutex;  // BackgroundTasks::Post wants one caller at a time
  BackgroundTasks decoders;
  ChunkCache cache;
  std::mutex mutex;                   // guards what follows
  std::map<std::string, Lane> lanes;  // by server; "": of files
  std::uint64_t far_bytes = 0;        // under way from all servers
  bool beginning = false;             // a thread runs tasks that have waited
};

ReadContext::ReadContext(const Limits& limits) : state_(std::make_shared<State>(limits)) {}
ReadContext::~ReadContext() = default;

ChunkCache& ReadContext::cache() { return state_->cache; }
std::uint64_t ReadContext::small_bytes() const { return state_->limits.small_bytes; }

void ReadContext::PostDecode(std::function<void()> task) {
  const std::lock_guard lock(state_->post_mutex);
  state_->decoders.Post(std::move(task));
}

void ReadContext::Admit(std::uint64_t bytes, std::function<void()> task, const std::string& server) {
  {
    const std::lock_guard lock(state_->mutex);
    State::Lane& lane = state_->lanes[server];
    if (!lane.waiting.empty() || !state_->Fits(server, lane, bytes)) {
      lane.waiting.push_back({bytes, std::move(task)});
      return;
    }
    state_->Begin(server, lane, bytes);
  }
  task();
}

void ReadContext::Release(std::uint64_t bytes, const std::string& server) {
  const std::shared_ptr<State> state = state_;  // a task may let go of the context
  std::unique_lock lock(state->mutex);
  State::Lane& released = state->lanes.at(server);
  --released.tasks;
  released.under_way -= bytes;
  if (!server.empty()) state->far_bytes -= bytes;
  // A task that ends at once calls this again. The loop that is under way then begins the next one, so calls do not nest deeper and deeper.
  if (std::exchange(state->beginning, true)) return;
  while (true) {
    const auto next = std::ranges::find_if(state->lanes, [&](const auto& each) {
      return !each.second.waiting.empty() && state->Fits(each.first, each.second, each.second.waiting.front().bytes);
    });
    if (next == state->lanes.end()) break;
    State::Waiting begun = std::move(next->second.waiting.front());
    next->second.waiting.pop_front();
    state->Begin(next->first, next->second, begun.bytes);
    lock.unlock();
    begun.task();
    begun.task = nullptr;  // may destroy a source
    lock.lock();
  }
  std::erase_if(state->lanes, [](const auto& each) { return each.second.tasks == 0 && each.second.waiting.empty(); });
  state->beginning = false;
}

}  // namespace slabstream
