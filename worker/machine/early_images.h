// EarlyImages: PartialImages that arrived before the assignment of their group, or before the Welcome, within a byte limit and for a while:
// a group that nobody was told of in this time will be handed out again under another name, or never was.
#pragma once

#include <cstdint>
#include <map>
#include <utility>
#include <vector>

#include "worker/machine/worker_machine.h"

namespace slabstream {

class EarlyImages {
 public:
  explicit EarlyImages(std::uint64_t limit_bytes) : limit_bytes_(limit_bytes) {}

  // Drops a second copy of the same image. ResourceExhausted: the limit is reached; the image is dropped.
  Status Keep(PartialImage message, Bytes payload, Time now);
  std::vector<std::pair<PartialImage, Bytes>> Take(const GroupKey& key);

  std::size_t size() const { return groups_.size(); }  // groups

  void ForgetSince(Time limit);  // groups of which the last image came before `limit`
  // Forgets the images for which `over(message)` is true.
  template <class Predicate>
  void Forget(Predicate over) {
    for (auto& [key, images] : groups_) {
      std::erase_if(images.images, [&](const auto& image) {
        const bool forgotten = over(image.first);
        if (forgotten) bytes_ -= Cost(image.first, image.second);
        return forgotten;
      });
    }
    std::erase_if(groups_, [](const auto& group) { return group.second.images.empty(); });
  }

 private:
  struct Group {
    std::vector<std::pair<PartialImage, Bytes>> images;
    Time last_came;
  };
  static std::uint64_t Cost(const PartialImage& message, const Bytes& payload) {
    return sizeof(PartialImage) + sizeof(RankReport) * message.reports.size() + payload.size();
  }

  std::uint64_t limit_bytes_;
  std::uint64_t bytes_ = 0;
  std::map<GroupKey, Group> groups_;
};

}  // namespace slabstream
