#include "common/transport/latest_seals.h"

namespace slabstream {

bool LatestSeals::Enter(const std::string& from, const Seal& seal) {
  const std::lock_guard lock(mutex_);
  const auto known = latest_.find(from);
  if (known != latest_.end() && known->second.name == seal.name) return true;
  if (known != latest_.end() && known->second.name.made >= seal.name.made) return false;
  latest_.insert_or_assign(from, Entry{seal.name, std::make_shared<Unsealer>(seal, max_payload_bytes_)});
  return true;
}

std::shared_ptr<Unsealer> LatestSeals::Of(const std::string& from) const {
  const std::lock_guard lock(mutex_);
  const auto known = latest_.find(from);
  return known == latest_.end() ? nullptr : known->second.unsealer;
}

}  // namespace slabstream
