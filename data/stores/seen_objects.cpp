#include "data/stores/seen_objects.h"

#include <algorithm>

namespace slabstream {
namespace {

bool IsSamePart(const SeenObjects::Part& a, const SeenObjects::Part& b) {
  return a.span.has_value() == b.span.has_value() && (!a.span || (a.span->begin == b.span->begin && a.span->bytes == b.span->bytes));
}

bool Holds(const std::deque<std::string>& versions, const std::string& version) {
  return std::ranges::find(versions, version) != versions.end();
}

}  // namespace

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

void SeenObjects::Take(Seen& seen, const News& news) {
  constexpr std::size_t kMostVersions = 4, kMostParts = 3;
  if (!news.version.empty() && !Holds(seen.versions, news.version)) seen.versions.push_back(news.version);
  if (seen.versions.size() > kMostVersions) seen.versions.pop_front();
  if (news.size != 0) seen.size = news.size;
  if (!news.part || std::ranges::any_of(seen.parts, [&](const Part& part) { return IsSamePart(part, *news.part); })) return;
  if (seen.parts.size() == kMostParts) seen.parts.erase(seen.parts.begin() + 1);
  seen.parts.push_back(*news.part);
}

SeenObjects::Verdict SeenObjects::Judge(const std::string& key, const News& news, Time now) {
  constexpr std::size_t kTrusted = 8;  // so many versions that meant nothing, and the server's versions are looked at but once a minute
  const std::lock_guard lock(mutex_);
  Seen& seen = Of(key);
  if (news.size != 0 && seen.size != 0 && news.size != seen.size) return Verdict::kChanged;
  std::size_t others = seen.parts.size();
  for (const Part& part : seen.parts) {
    if (!news.part || !IsSamePart(part, *news.part)) continue;
    if (part.digest != news.part->digest) return Verdict::kChanged;
    --others;
  }
  const bool other_version = !news.version.empty() && !seen.versions.empty() && !Holds(seen.versions, news.version);
  const bool compared = meaningless_ >= kTrusted && seen.compared && now - *seen.compared < kFresh;
  if (other_version && others > 0 && !compared) return Verdict::kMustBeCompared;
  Take(seen, news);
  return Verdict::kSame;
}

std::vector<SeenObjects::Part> SeenObjects::parts(const std::string& key) const {
  const std::lock_guard lock(mutex_);
  const auto found = seen_.find(key);
  return found == seen_.end() ? std::vector<Part>() : found->second.parts;
}

void SeenObjects::Accept(const std::string& key, const News& news, Time now) {
  const std::lock_guard lock(mutex_);
  Seen& seen = Of(key);
  ++meaningless_;
  seen.compared = now;
  Take(seen, news);
}

void SeenObjects::NoteVersion(const std::string& key, const std::string& version, Time now) {
  if (version.empty()) return;
  const std::lock_guard lock(mutex_);
  Seen& seen = Of(key);
  if (seen.versions.empty()) seen.versions.push_back(version);
  if (Holds(seen.versions, version)) seen.said = now;
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
  return found != seen_.end() && Holds(found->second.versions, version) && found->second.said && now - *found->second.said < kFresh;
}

std::string SeenObjects::StrongVersionOf(const std::string& key) const {
  const std::lock_guard lock(mutex_);
  const auto found = seen_.find(key);
  const bool is_strong = found != seen_.end() && !found->second.versions.empty() && found->second.versions.back().starts_with('"');
  return is_strong ? found->second.versions.back() : "";
}

bool SeenObjects::IsMissing(const std::string& key, Time now) const {
  const std::lock_guard lock(mutex_);
  const auto found = seen_.find(key);
  return found != seen_.end() && found->second.missed && now - *found->second.missed < kFresh;
}

}  // namespace slabstream
