#include "common/transport/latest_seals.h"

namespace slabstream {

bool LatestSeals::Enter(const std::string& from, const Seal& seal) {
  const std::lock_guard lock(mutex_);
  Entry& latest = latest_[from];
  if (latest.seal.name == seal.name) return true;
  if (latest.seal.name.made >= seal.name.made) return false;
  latest = {{.name = seal.name, .key = seal.key, .ticket = {}}, {}, nullptr};
  return true;
}

void LatestSeals::Retire(const std::string& from) {
  const std::lock_guard lock(mutex_);
  const auto known = latest_.find(from);
  if (known == latest_.end() || known->second.unsealer == nullptr) return;
  known->second.heard = known->second.unsealer->last();
  known->second.unsealer.reset();
}

std::shared_ptr<Unsealer> LatestSeals::Of(const std::string& from) {
  const std::lock_guard lock(mutex_);
  const auto known = latest_.find(from);
  if (known == latest_.end()) return nullptr;
  Entry& latest = known->second;
  if (latest.unsealer == nullptr) latest.unsealer = std::make_shared<Unsealer>(latest.seal, max_payload_bytes_, latest.heard);
  return latest.unsealer;
}

}  // namespace slabstream
