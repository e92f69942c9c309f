#include "worker/shapes/shared_shapes.h"

#include <algorithm>
#include <list>
#include <mutex>
#include <optional>

namespace slabstream {
namespace {

struct Entry {
  explicit Entry(const FrameSetup& of) : setup(of) {}
  const FrameSetup setup;
  std::mutex mutex;  // guards what follows; one thread makes them, and others wait
  std::optional<Result<std::shared_ptr<const FrameShapes>>> shapes;
};

constexpr std::size_t kMostFrames = 3;  // that are rendered and finished at a time

std::shared_ptr<Entry> EntryOf(const FrameSetup& setup) {
  static std::mutex mutex;
  static std::list<std::shared_ptr<Entry>> latest;  // the last one used first
  const std::lock_guard lock(mutex);
  const auto found = std::ranges::find_if(latest, [&](const auto& entry) { return entry->setup == setup; });
  if (found != latest.end()) {
    latest.splice(latest.begin(), latest, found);
  } else {
    latest.push_front(std::make_shared<Entry>(setup));
    if (latest.size() > kMostFrames) latest.pop_back();
  }
  return latest.front();
}

}  // namespace

Result<std::shared_ptr<const FrameShapes>> SharedFrameShapes(const FrameSetup& setup,
                                                             std::span<const std::shared_ptr<const VoxelBlock>> bytes,
                                                             const std::shared_ptr<const FrameLight>& light) {
  const std::shared_ptr<Entry> entry = EntryOf(setup);
  const std::lock_guard lock(entry->mutex);
  if (!entry->shapes) entry->shapes = MakeFrameShapes(setup, bytes, light);
  return *entry->shapes;
}

}  // namespace slabstream
