#include "data/sources/held_voxels.h"

#include <map>
#include <mutex>
#include <utility>

namespace slabstream {
namespace {

struct Published {
  std::mutex mutex;
  std::map<std::uint64_t, std::weak_ptr<const HeldVoxels>> held;  // guarded by mutex
};

// Never destroyed: threads may outlive it.
Published& OfProcess() {
  static Published& published = *new Published();
  return published;
}

}  // namespace

std::shared_ptr<const HeldVoxels> HeldVoxels::Publish(std::uint64_t dataset, HeldVoxels held) {
  auto kept = std::make_shared<const HeldVoxels>(std::move(held));
  Published& published = OfProcess();
  const std::lock_guard lock(published.mutex);
  std::erase_if(published.held, [](const auto& each) { return each.second.expired(); });
  published.held[dataset] = kept;
  return kept;
}

std::shared_ptr<const HeldVoxels> HeldVoxels::Find(std::uint64_t dataset) {
  Published& published = OfProcess();
  const std::lock_guard lock(published.mutex);
  const auto found = published.held.find(dataset);
  return found == published.held.end() ? nullptr : found->second.lock();
}

}  // namespace slabstream
