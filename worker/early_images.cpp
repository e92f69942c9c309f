#include "worker/early_images.h"

#include <fmt/format.h>

#include <algorithm>

namespace slabstream {

Status EarlyImages::Keep(PartialImage message, Bytes payload) {
  if (const auto group = groups_.find(message.key); group != groups_.end()) {
    const bool known = std::ranges::any_of(group->second, [&](const auto& image) {
      return image.first.epoch == message.epoch && image.first.step == message.step && image.first.pixels == message.pixels &&
             image.first.from_worker == message.from_worker;
    });
    if (known) return Status::Ok();
  }
  const std::uint64_t bytes = bytes_ + Cost(message, payload);
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
  auto group = groups_.extract(key);
  if (group.empty()) return {};
  for (const auto& image : group.mapped()) bytes_ -= Cost(image.first, image.second);
  return std::move(group.mapped());
}

}  // namespace slabstream
