#include "data/stores/seen_objects.h"

namespace slabstream {

SeenObjects::Seen& SeenObjects::Of(const std::string& key) {
  const auto [found, is_new] = seen_.try_emplace(key);
  if (is_new) {
    order_.push_back(key);
    if (order_.size() > kMost) {
      seen_.erase(order_.front());
      order_.pop_front();
    }
  }
  return found->second;
}

bool SeenObjects::Agrees(const std::string& key, const std::string& version) {
  if (version.empty()) return true;
  const std::lock_guard lock(mutex_);
  Seen& seen = Of(key);
  if (seen.version.empty()) seen.version = version;
  return seen.version == version;
}

void SeenObjects::NoteVersion(const std::string& key, const std::string& version, Time now) {
  if (version.empty()) return;
  const std::lock_guard lock(mutex_);
  Seen& seen = Of(key);
  if (seen.version.empty()) seen.version = version;
  if (seen.version == version) seen.said = now;
  seen.missed.reset();
}

void SeenObjects::NoteMissing(const std::string& key, Time now) {
  const std::lock_guard lock(mutex_);
  Seen& seen = Of(key);
  seen.missed = now;
  seen.said.reset();
}

bool SeenObjects::IsFresh(const std::string& key, const std::string& version, Time now) const {
  const std::lock_guard lock(mutex_);
  const auto found = seen_.find(key);
  return found != seen_.end() && found->second.version == version && found->second.said && now - *found->second.said < kFresh;
}

bool SeenObjects::IsMissing(const std::string& key, Time now) const {
  const std::lock_guard lock(mutex_);
  const auto found = seen_.find(key);
  return found != seen_.end() && found->second.missed && now - *found->second.missed < kFresh;
}

}  // namespace slabstream
