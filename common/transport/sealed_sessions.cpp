#include "common/transport/sealed_sessions.h"

namespace slabstream {

bool SealedSessions::Enter(const std::string& from, const Session& session) {
  const std::lock_guard lock(mutex_);
  const auto known = latest_.find(from);
  if (known != latest_.end() && known->second.name == session.name) return true;
  if (known != latest_.end() && known->second.name.made >= session.name.made) return false;
  latest_.insert_or_assign(from, Entry{session.name, std::make_shared<Unsealer>(session, max_payload_bytes_)});
  return true;
}

std::shared_ptr<Unsealer> SealedSessions::Of(const std::string& from) const {
  const std::lock_guard lock(mutex_);
  const auto known = latest_.find(from);
  return known == latest_.end() ? nullptr : known->second.unsealer;
}

}  // namespace slabstream
