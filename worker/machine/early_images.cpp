#include "worker/machine/early_images.h"

#include <fmt/format.h>

#include <algorithm>

namespace slabstream {

Status EarlyImages::Keep(PartialImage message, Bytes payload, Time now) {
  if (const auto group = groups_.find(message.key); group != groups_.end()) {
    const bool known = std::ranges::any_of(group->second.images, [&](const auto& image) {
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
  Group& group = groups_[key];
  group.images.emplace_back(std::move(message), std::move(payload));
  group.last_came = now;
  return Status::Ok();
}

std::vector<std::pair<PartialImage, Bytes>> EarlyImages::Take(const GroupKey& key) {
  auto group = groups_.extract(key);
  if (group.empty()) return {};
  for (const auto& image : group.mapped().images) bytes_ -= Cost(image.first, image.second);
  return std::move(group.mapped().images);
}

void EarlyImages::ForgetSince(Time limit) {
  std::erase_if(groups_, [&](const auto& group) {
    if (group.second.last_came >= limit) return false;
    for (const auto& image : group.second.images) bytes_ -= Cost(image.first, image.second);
    return true;
  });
}

}  // namespace slabstream
