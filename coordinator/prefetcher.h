// Prefetcher: fetches blocks that pictures will probably show from web servers, so that this host keeps them on disk (ObjectCache). Frames
// that show them later find them there. It asks for half as much at a time as a process may, so what frames wait for hardly waits for it.
// The newest wish comes first, and a wish lasts for kLasts: whoever turns a view sends new ones.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "common/base/status.h"
#include "common/base/time.h"
#include "common/volume/box.h"
#include "common/volume/stored_at.h"

namespace slabstream {

class Prefetcher {
 public:
  static constexpr std::size_t kMostBlocks = 1024;  // of a wish: what lies behind so many is mostly hidden
  static constexpr Duration kLasts = std::chrono::seconds(1);

  Prefetcher();
  ~Prefetcher();  // stops what is under way
  Prefetcher(const Prefetcher&) = delete;
  Prefetcher& operator=(const Prefetcher&) = delete;

  // Whether voxels there come from a web server and this process keeps what servers send. Any thread.
  static bool Fetches(const StoredAt& stored);

  // Begins to fetch `blocks`, the first one first, but for those that it has fetched lately. Waits while the source is opened. Any thread.
  // Errors of OpenSameSource.
  Status Fetch(const StoredAt& stored, std::vector<Box> blocks);

 private:
  struct State;
  const std::shared_ptr<State> state_;  // reads share it
};

}  // namespace slabstream
