// EarlyImages: PartialImages that arrived before the assignment of their group, within a byte limit.
#pragma once

#include <cstdint>
#include <map>
#include <utility>
#include <vector>

#include "worker/worker_machine.h"

namespace slabstream {

class EarlyImages {
 public:
  explicit EarlyImages(std::uint64_t limit_bytes) : limit_bytes_(limit_bytes) {}

  // Drops a second copy of the same image. ResourceExhausted: the limit is reached; the image is dropped.
  Status Keep(PartialImage message, Bytes payload);
  std::vector<std::pair<PartialImage, Bytes>> Take(const GroupKey& key);

  // Forgets the images of every group for which `over(key)` is true.
  template <class Predicate>
  void Forget(Predicate over) {
    std::erase_if(groups_, [&](const auto& group) {
      if (!over(group.first)) return false;
      for (const auto& image : group.second) bytes_ -= Cost(image.second);
      return true;
    });
  }

 private:
  static std::uint64_t Cost(const Bytes& payload) { return sizeof(PartialImage) + payload.size(); }

  std::uint64_t limit_bytes_;
  std::uint64_t bytes_ = 0;
  std::map<GroupKey, std::vector<std::pair<PartialImage, Bytes>>> groups_;
};

}  // namespace slabstream
