// LatestSeals: the seals of one plane of sealed connections, at the end that listens: one a key, the latest. Private to this folder.
//
// A ticket is no secret: whoever has recorded one may connect with it, and must not be believed what was said before. So what was heard of
// a seal is remembered after its connections, and even after its key has left the plane. That takes some 300 bytes a key.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>

#include "common/transport/sealing.h"

namespace slabstream {

// Any thread.
class LatestSeals {
 public:
  LatestSeals(KeyPair own, std::uint64_t max_payload_bytes) : own_(std::move(own)), max_payload_bytes_(max_payload_bytes) {}

  // None: the holder of `from` did not make the ticket.
  std::optional<Seal> Read(std::string_view ticket, const std::string& from) const { return Seal::Read(ticket, from, own_); }

  // Makes it the seal of `from`, if it is not already. False: there is a later one.
  bool Enter(const std::string& from, const Seal& seal);

  // What opens frames of the seal of `from`, for the socket's thread only; null: it has none.
  std::shared_ptr<Unsealer> Of(const std::string& from);

  // On the socket's thread: the connections of `from` that were heard of were ended. Frees what only connections need, until another one
  // is heard of.
  void Retire(const std::string& from);

 private:
  struct Entry {
    Seal seal;                           // without its ticket
    Unsealer::Place heard;               // before it was retired
    std::shared_ptr<Unsealer> unsealer;  // null: it is retired
  };
  const KeyPair own_;
  const std::uint64_t max_payload_bytes_;
  mutable std::mutex mutex_;
  std::map<std::string, Entry> latest_;  // by public key; guarded by mutex_
};

}  // namespace slabstream
