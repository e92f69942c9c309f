// EarlyMessages: PartialImages or ShapeTiles that arrived before the assignment that tells what to do with them, or before the Welcome. It
// keeps them within a byte limit and for a while: an assignment that does not come in this time comes under another key, or never.
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <map>
#include <utility>
#include <vector>

#include "worker/machine/worker_machine.h"

namespace slabstream {

// The part of an assignment's key that they await; whether two of one such key and epoch are copies; their bytes in memory.
inline GroupKey KeyOf(const PartialImage& image) { return image.key; }
inline bool IsCopy(const PartialImage& a, const PartialImage& b) {
  return a.step == b.step && a.pixels == b.pixels && a.from_worker == b.from_worker;
}
inline std::size_t BytesOf(const PartialImage& image) { return sizeof(PartialImage) + sizeof(RankReport) * image.reports.size(); }
inline FrameId KeyOf(const ShapeTiles& tiles) { return tiles.key.frame; }
inline bool IsCopy(const ShapeTiles& a, const ShapeTiles& b) { return a.key == b.key && a.from_worker == b.from_worker; }
inline std::size_t BytesOf(const ShapeTiles& tiles) { return sizeof(ShapeTiles) + 2 * sizeof(std::uint32_t) * tiles.tiles.size(); }

template <class Message>
class EarlyMessages {
 public:
  using Key = decltype(KeyOf(std::declval<Message>()));
  using Kept = std::pair<Message, Bytes>;

  explicit EarlyMessages(std::uint64_t limit_bytes) : limit_bytes_(limit_bytes) {}

  // Drops a second copy of the same message. ResourceExhausted: the limit is reached; the message is dropped.
  Status Keep(Message message, Bytes payload, Time now) {
    Entry& entry = entries_[KeyOf(message)];
    const auto known = [&](const Kept& kept) { return kept.first.epoch == message.epoch && IsCopy(kept.first, message); };
    if (std::ranges::any_of(entry.kept, known)) return Status::Ok();
    const std::uint64_t bytes = bytes_ + Cost(message, payload);
    if (bytes > limit_bytes_) {
      if (entry.kept.empty()) entries_.erase(KeyOf(message));
      return Status::ResourceExhausted(
          fmt::format("messages that came before their assignment take {} bytes, at most {} are kept", bytes, limit_bytes_));
    }
    bytes_ = bytes;
    entry.kept.emplace_back(std::move(message), std::move(payload));
    entry.last_came = now;
    return Status::Ok();
  }

  std::vector<Kept> Take(const Key& key) {
    auto entry = entries_.extract(key);
    if (entry.empty()) return {};
    for (const auto& [message, payload] : entry.mapped().kept) bytes_ -= Cost(message, payload);
    return std::move(entry.mapped().kept);
  }

  std::size_t size() const { return entries_.size(); }  // keys

  // All messages of each key whose last one came before `limit`.
  void ForgetBefore(Time limit) {
    std::erase_if(entries_, [&](const auto& entry) {
      if (entry.second.last_came >= limit) return false;
      for (const auto& [message, payload] : entry.second.kept) bytes_ -= Cost(message, payload);
      return true;
    });
  }
  // The messages for which `over(message)` is true.
  template <class Predicate>
  void Forget(Predicate over) {
    for (auto& [key, entry] : entries_) {
      std::erase_if(entry.kept, [&](const Kept& kept) {
        const bool forgotten = over(kept.first);
        if (forgotten) bytes_ -= Cost(kept.first, kept.second);
        return forgotten;
      });
    }
    std::erase_if(entries_, [](const auto& entry) { return entry.second.kept.empty(); });
  }

 private:
  struct Entry {
    std::vector<Kept> kept;
    Time last_came;
  };
  static std::uint64_t Cost(const Message& message, const Bytes& payload) { return BytesOf(message) + payload.size(); }

  const std::uint64_t limit_bytes_;
  std::uint64_t bytes_ = 0;
  std::map<Key, Entry> entries_;
};

}  // namespace slabstream
