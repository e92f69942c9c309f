// Sealed connections: how images travel between hosts. CURVE's cipher moves 1 GB/s through a thread; this one moves several. A message is
// cut into frames, each sealed by AES-128-OCB (RFC 7253), so that frames are sealed, sent and opened at the same time. Messages go one way
// only: from whoever connects to whoever listens. Private to this folder.
//
//   1. Both have Curve25519 keys, and each knows the other's public one. Whoever connects makes a Seal: a name for it, and from the two
//      keys and the name the seal's secrets (X25519, then HKDF-SHA256). Its Ticket, the name and a proof, goes with the handshake.
//   2. Whoever listens derives the same secrets from the ticket, and believes it if the proof is the same (LatestSeals).
//   3. Sealer makes frames of messages, Unsealer makes messages of frames.
// Nothing but the keys' holders can make or read any of it. Nothing is accepted twice: names of seals grow, and so do numbers of frames.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "common/memory/bytes.h"
#include "common/memory/pooled_vector.h"
#include "common/transport/keys.h"

struct evp_cipher_ctx_st;

namespace slabstream {

// A frame has four parts. All numbers are little endian.
//   8 bytes   number of the message in its seal, from 1
//   4 bytes   number of the frame in its message, from 0; both numbers together are the nonce
//   ...       ciphertext
//   16 bytes  tag
// The plaintext of a message's frames, one after the other, is:
//   4 bytes   size of the header
//   8 bytes   size of the payload
//   ...       header, payload
// All frames of a message but the last one have kSealedFrameBytes.
inline constexpr std::size_t kSealedFrameBytes = std::size_t{1} << 18;  // those under way stay in a cache
inline constexpr std::size_t kSealedPlaceBytes = 12, kSealedTagBytes = 16, kSealedSizesBytes = 12;
// Bytes of plaintext in a frame.
inline constexpr std::size_t kSealedPartBytes = kSealedFrameBytes - kSealedPlaceBytes - kSealedTagBytes;
inline constexpr std::size_t kMaxSealedHeaderBytes = kSealedPartBytes - kSealedSizesBytes;  // headers fit in the first frame

// The frames of the largest message.
constexpr std::size_t SealedFrames(std::uint64_t payload_bytes) { return std::size_t(payload_bytes / kSealedPartBytes) + 2; }

struct SealName {
  std::uint64_t made = 0;                 // nanoseconds of the maker's monotonic clock: later seals of one process have greater ones
  std::array<std::uint8_t, 16> chance{};  // random: no two seals have the same name
  friend bool operator==(const SealName&, const SealName&) = default;
};

struct Seal {
  using Secret = std::array<std::uint8_t, 32>;  // keys of frames are derived from it
  SealName name;
  Secret key{};
  std::string ticket;  // 70 printable characters

  // A new one, from the holder of `own` to the holder of the public key `to`. None: `to` is no key, or one that fits every secret.
  static std::optional<Seal> Make(const KeyPair& own, const std::string& to);
  // The one that `ticket` is of, as the holder of `own` sees it. None: the holder of `from` did not make it for `own`.
  static std::optional<Seal> Read(std::string_view ticket, const std::string& from, const KeyPair& own);
};

class FrameCipher;

// Seals one message after the other.
class Sealer {
 public:
  explicit Sealer(const Seal& seal);
  ~Sealer();

  // Then Next() until it is empty. `header` is at most kMaxSealedHeaderBytes; both stay until then. What was left of the last message is
  // left out, and its receiver drops it.
  void Begin(std::span<const std::byte> header, std::span<const std::byte> payload);
  PooledVector<std::byte> Next();

 private:
  const std::unique_ptr<FrameCipher> cipher_;
  std::uint64_t message_ = 0;
  std::uint32_t frame_ = 0;
  std::vector<std::byte> front_;  // sizes and header
  std::span<const std::byte> left_;
  bool done_ = true;
};

// Opens what one Sealer has sealed. Frames may be missing, as when a connection breaks; a message that lacks any is dropped.
class Unsealer {
 public:
  // A frame's place in its seal.
  struct Place {
    std::uint64_t message = 0;  // the first one is number 1
    std::uint32_t frame = 0;
    friend auto operator<=>(const Place&, const Place&) = default;
  };

  // Frames up to `last` were opened before. Messages with a larger payload are dropped.
  Unsealer(const Seal& seal, std::uint64_t max_payload_bytes, Place last);
  Unsealer(const Seal& seal, std::uint64_t max_payload_bytes) : Unsealer(seal, max_payload_bytes, Place()) {}
  ~Unsealer();

  struct Forged {};                    // altered, cut, sealed by somebody else, or seen before
  struct More {};                      // the frame counts; its message is not complete
  using Message = std::vector<Bytes>;  // header, and payload if there is one
  // `scratch` may be any vector; to use the same one for all seals of a thread spares each a frame's memory.
  std::variant<Forged, More, Message> Open(std::span<const std::byte> frame, std::vector<std::byte>& scratch);

  Place last() const { return last_; }  // the last of the frames that were opened

 private:
  struct Partial {
    Bytes header;
    PooledVector<std::byte> payload;
    std::size_t filled = 0;
    Place next;
  };
  bool Begin(std::span<const std::byte> plain, Place place);
  Message Take();

  const std::unique_ptr<FrameCipher> cipher_;
  const std::uint64_t max_payload_bytes_;
  Place last_;
  std::optional<Partial> partial_;
};

}  // namespace slabstream
