#include "worker/early_images.h"

#include <fmt/format.h>

#include <algorithm>

namespace slabstream {

Status EarlyImages::Keep(PartialImage message, Bytes payload) {
  if (const auto group = groups_.find(message.key); group != groups_.end()) {
    const bool known = std::any_of(group->second.begin(), group->second.end(), [&](const auto& image) {
      return image.first.step == message.step && image.first.pixels == message.pixels && image.first.from_worker == message.from_worker;
    });
    if (known) return Status::Ok();
  }
  const std::uint64_t bytes = bytes_ + Cost(payload);
  if (bytes > limit_bytes_) {
    return Status::ResourceExhausted(
        fmt::format("partial images that came before their assignment take {} bytes, at most {} are kept", bytes, limit_bytes_));
  }
  bytes_ = bytes;
  const GroupKey key = message.key;
  groups_[key].emplace_back(std::move(message), std::move(payload));
  return Status::Ok();
}

std::vector<std::pair<PartialImage, Bytes>> EarlyImages::Take(const GroupKey& key) {
  const auto group = groups_.find(key);
  if (group == groups_.end()) return {};
  std::vector<std::pair<PartialImage, Bytes>> images = std::move(group->second);
  groups_.erase(group);
  for (const auto& image : images) bytes_ -= Cost(image.second);
  return images;
}

}  // namespace slabstream
