#include "common/transport/sealing.h"

#include <openssl/crypto.h>
#include <openssl/evp.h>
#include <openssl/kdf.h>
#include <openssl/rand.h>
#include <zmq.h>

#include <algorithm>
#include <utility>

#include "common/base/check.h"
#include "common/base/time.h"

namespace slabstream {
namespace {

constexpr std::size_t kKeyBytes = 32, kProofBytes = 32, kFrameKeyBytes = 16, kNameBytes = 8 + 16;
constexpr std::size_t kTicketBytes = kNameBytes + kProofBytes, kTicketTextBytes = kTicketBytes / 4 * 5;  // Z85
constexpr std::string_view kPurpose = "slabstream sealed connection 2";

using RawKey = std::array<std::uint8_t, kKeyBytes>;
using Pkey = std::unique_ptr<EVP_PKEY, decltype(&EVP_PKEY_free)>;
using PkeyContext = std::unique_ptr<EVP_PKEY_CTX, decltype(&EVP_PKEY_CTX_free)>;

std::uint8_t* Raw(std::byte* data) { return reinterpret_cast<std::uint8_t*>(data); }
const std::uint8_t* Raw(const std::byte* data) { return reinterpret_cast<const std::uint8_t*>(data); }

template <class Number>
void StoreLittle(Number number, std::uint8_t* to) {
  for (std::size_t i = 0; i < sizeof(Number); ++i) to[i] = std::uint8_t(number >> (8 * i));
}
template <class Number>
Number LoadLittle(const std::uint8_t* from) {
  Number number = 0;
  for (std::size_t i = 0; i < sizeof(Number); ++i) number |= Number{from[i]} << (8 * i);
  return number;
}

std::optional<RawKey> RawOf(const std::string& text) {
  RawKey raw{};
  if (!IsKey(text)) return std::nullopt;
  zmq_z85_decode(raw.data(), text.c_str());
  return raw;
}

// The secret that both holders can compute.
std::optional<RawKey> SharedSecret(const RawKey& own_secret, const RawKey& other_public) {
  const Pkey own(EVP_PKEY_new_raw_private_key(EVP_PKEY_X25519, nullptr, own_secret.data(), own_secret.size()), EVP_PKEY_free);
  const Pkey other(EVP_PKEY_new_raw_public_key(EVP_PKEY_X25519, nullptr, other_public.data(), other_public.size()), EVP_PKEY_free);
  const PkeyContext context(EVP_PKEY_CTX_new(own.get(), nullptr), EVP_PKEY_CTX_free);
  RawKey shared{};
  std::size_t bytes = shared.size();
  if (EVP_PKEY_derive_init(context.get()) != 1 || EVP_PKEY_derive_set_peer(context.get(), other.get()) != 1 ||
      EVP_PKEY_derive(context.get(), shared.data(), &bytes) != 1) {
    return std::nullopt;  // a public key of small order
  }
  return shared;
}

struct Secrets {
  Seal::Secret key;
  std::array<std::uint8_t, kProofBytes> proof;
};

// HKDF-SHA256 (RFC 5869).
void Expand(std::span<const std::uint8_t> secret, std::span<const std::uint8_t> salt, std::span<const std::uint8_t> purpose,
            std::span<std::uint8_t> out) {
  std::size_t bytes = out.size();
  const PkeyContext context(EVP_PKEY_CTX_new_id(EVP_PKEY_HKDF, nullptr), EVP_PKEY_CTX_free);
  CHECK_EQ(EVP_PKEY_derive_init(context.get()), 1);
  CHECK_EQ(EVP_PKEY_CTX_set_hkdf_md(context.get(), EVP_sha256()), 1);
  CHECK_EQ(EVP_PKEY_CTX_set1_hkdf_key(context.get(), secret.data(), int(secret.size())), 1);
  CHECK_EQ(EVP_PKEY_CTX_set1_hkdf_salt(context.get(), salt.data(), int(salt.size())), 1);
  std::vector<std::uint8_t> info(kPurpose.begin(), kPurpose.end());
  info.insert(info.end(), purpose.begin(), purpose.end());
  CHECK_EQ(EVP_PKEY_CTX_add1_hkdf_info(context.get(), info.data(), int(info.size())), 1);
  CHECK_EQ(EVP_PKEY_derive(context.get(), out.data(), &bytes), 1);
}

// The direction is part of it: what B sends to A has other secrets than what A sends to B.
Secrets Derive(const RawKey& shared, const std::array<std::uint8_t, kNameBytes>& name, const RawKey& from, const RawKey& to) {
  std::array<std::uint8_t, 2 * kKeyBytes> direction{};
  std::ranges::copy(from, direction.begin());
  std::ranges::copy(to, direction.begin() + kKeyBytes);
  std::array<std::uint8_t, sizeof(Secrets::key) + kProofBytes> out{};
  Expand(shared, name, direction, out);
  Secrets secrets{};
  std::copy_n(out.begin(), secrets.key.size(), secrets.key.begin());
  std::copy_n(out.begin() + secrets.key.size(), kProofBytes, secrets.proof.begin());
  return secrets;
}

std::array<std::uint8_t, kNameBytes> BytesOf(const SealName& name) {
  std::array<std::uint8_t, kNameBytes> bytes{};
  StoreLittle(name.made, bytes.data());
  std::ranges::copy(name.chance, bytes.begin() + 8);
  return bytes;
}

}  // namespace

std::optional<Seal> Seal::Make(const KeyPair& own, const std::string& to) {
  const std::optional<RawKey> secret = RawOf(own.secret_key), from = RawOf(own.public_key), receiver = RawOf(to);
  if (!secret || !from || !receiver) return std::nullopt;
  const std::optional<RawKey> shared = SharedSecret(*secret, *receiver);
  if (!shared) return std::nullopt;
  Seal seal;
  seal.name.made = std::uint64_t(std::chrono::nanoseconds(MonotonicNow().time_since_epoch()).count());
  CHECK_EQ(RAND_bytes(seal.name.chance.data(), int(seal.name.chance.size())), 1);
  const std::array<std::uint8_t, kNameBytes> name = BytesOf(seal.name);
  const Secrets secrets = Derive(*shared, name, *from, *receiver);
  seal.key = secrets.key;
  std::array<std::uint8_t, kTicketBytes> ticket{};
  std::ranges::copy(name, ticket.begin());
  std::ranges::copy(secrets.proof, ticket.begin() + kNameBytes);
  seal.ticket.resize(kTicketTextBytes + 1);
  zmq_z85_encode(seal.ticket.data(), ticket.data(), ticket.size());
  seal.ticket.pop_back();  // the closing zero
  return seal;
}

std::optional<Seal> Seal::Read(std::string_view text, const std::string& from, const KeyPair& own) {
  std::array<std::uint8_t, kTicketBytes> ticket{};
  if (text.size() != kTicketTextBytes || zmq_z85_decode(ticket.data(), std::string(text).c_str()) == nullptr) return std::nullopt;
  const std::optional<RawKey> secret = RawOf(own.secret_key), sender = RawOf(from), to = RawOf(own.public_key);
  if (!secret || !sender || !to) return std::nullopt;
  const std::optional<RawKey> shared = SharedSecret(*secret, *sender);
  if (!shared) return std::nullopt;
  Seal seal;
  seal.ticket = text;
  seal.name.made = LoadLittle<std::uint64_t>(ticket.data());
  std::copy_n(ticket.begin() + 8, seal.name.chance.size(), seal.name.chance.begin());
  const Secrets secrets = Derive(*shared, BytesOf(seal.name), *sender, *to);
  seal.key = secrets.key;
  if (CRYPTO_memcmp(secrets.proof.data(), ticket.data() + kNameBytes, kProofBytes) != 0) return std::nullopt;
  return seal;
}

// One direction of one seal.
class FrameCipher {
 public:
  FrameCipher(const Seal& seal, bool seals) : secret_(seal.key), seals_(seals) { CHECK(context_ != nullptr); }

  // Of the next frame. Its `to` has room for as many bytes as will pass.
  void Begin(std::uint64_t message, const std::byte* place, std::byte* to) {
    if (!key_number_ || *key_number_ != message / kMessagesOfAKey) UseKey(message / kMessagesOfAKey);
    CHECK_EQ(EVP_CipherInit_ex(context_.get(), nullptr, nullptr, nullptr, Raw(place), -1), 1);
    to_ = to;
  }

  // At most kSealedPartBytes at a time.
  void Pass(std::span<const std::byte> from) {
    int bytes = 0;  // fewer than those of `from`, if they end within a block
    CHECK_EQ(EVP_CipherUpdate(context_.get(), Raw(to_), &bytes, Raw(from.data()), int(from.size())), 1);
    to_ += bytes;
  }

  void WriteTag(std::byte* tag) {
    CHECK(seals_ && Finish());
    CHECK_EQ(EVP_CIPHER_CTX_ctrl(context_.get(), EVP_CTRL_AEAD_GET_TAG, int(kSealedTagBytes), tag), 1);
  }
  bool TagFits(const std::byte* tag) {
    CHECK_EQ(EVP_CIPHER_CTX_ctrl(context_.get(), EVP_CTRL_AEAD_SET_TAG, int(kSealedTagBytes), const_cast<std::byte*>(tag)), 1);
    return Finish();
  }

 private:
  // RFC 7253, 5.1: a key should seal no more than 2^48 bytes. So many messages of 2 GiB have half of that.
  static constexpr std::uint64_t kMessagesOfAKey = std::uint64_t{1} << 16;

  void UseKey(std::uint64_t number) {
    std::array<std::uint8_t, kFrameKeyBytes> key{};
    std::array<std::uint8_t, sizeof(number)> salt{};
    StoreLittle(number, salt.data());
    Expand(secret_, salt, {}, key);
    CHECK_EQ(EVP_CipherInit_ex(context_.get(), EVP_aes_128_ocb(), nullptr, key.data(), nullptr, seals_ ? 1 : 0), 1);
    key_number_ = number;
  }
  bool Finish() {
    int bytes = 0;
    return EVP_CipherFinal_ex(context_.get(), Raw(to_), &bytes) == 1;
  }
  struct Free {
    void operator()(EVP_CIPHER_CTX* context) const { EVP_CIPHER_CTX_free(context); }
  };
  const Seal::Secret secret_;
  const bool seals_;
  const std::unique_ptr<EVP_CIPHER_CTX, Free> context_{EVP_CIPHER_CTX_new()};
  std::optional<std::uint64_t> key_number_;
  std::byte* to_ = nullptr;
};

Sealer::Sealer(const Seal& seal) : cipher_(std::make_unique<FrameCipher>(seal, true)) {}
Sealer::~Sealer() = default;

void Sealer::Begin(std::span<const std::byte> header, std::span<const std::byte> payload) {
  CHECK_LE(header.size(), kMaxSealedHeaderBytes);
  ++message_;
  frame_ = 0;
  front_.resize(kSealedSizesBytes);
  StoreLittle(std::uint32_t(header.size()), Raw(front_.data()));
  StoreLittle(std::uint64_t(payload.size()), Raw(front_.data()) + 4);
  front_.insert(front_.end(), header.begin(), header.end());
  left_ = payload;
  done_ = false;
}

PooledVector<std::byte> Sealer::Next() {
  if (done_) return {};
  const std::span<const std::byte> part = left_.first(std::min(left_.size(), kSealedPartBytes - front_.size()));
  PooledVector<std::byte> sealed;
  sealed.resize(kSealedPlaceBytes + front_.size() + part.size() + kSealedTagBytes);
  StoreLittle(message_, Raw(sealed.data()));
  StoreLittle(frame_++, Raw(sealed.data()) + 8);
  std::byte* const to = sealed.data() + kSealedPlaceBytes;
  cipher_->Begin(message_, sealed.data(), to);
  for (const std::span<const std::byte> piece : {std::span<const std::byte>(front_), part}) {
    if (!piece.empty()) cipher_->Pass(piece);
  }
  cipher_->WriteTag(to + front_.size() + part.size());
  front_.clear();
  left_ = left_.subspan(part.size());
  done_ = left_.empty();
  return sealed;
}

Unsealer::Unsealer(const Seal& seal, std::uint64_t max_payload_bytes, Place last)
    : cipher_(std::make_unique<FrameCipher>(seal, false)), max_payload_bytes_(max_payload_bytes), last_(last) {}
Unsealer::~Unsealer() = default;

std::variant<Unsealer::Forged, Unsealer::More, Unsealer::Message> Unsealer::Open(std::span<const std::byte> frame,
                                                                                 std::vector<std::byte>& scratch) {
  if (frame.size() < kSealedPlaceBytes + kSealedTagBytes || frame.size() > kSealedFrameBytes) return Forged{};
  const Place place = {LoadLittle<std::uint64_t>(Raw(frame.data())), LoadLittle<std::uint32_t>(Raw(frame.data()) + 8)};
  const bool first = place.frame == 0;
  if (first ? place.message <= last_.message : place <= last_) return Forged{};
  const std::span<const std::byte> sealed = frame.subspan(kSealedPlaceBytes, frame.size() - kSealedPlaceBytes - kSealedTagBytes);

  // The frame that the message lacks is opened into its place. If it turns out to be forged, the right one is written over it.
  const bool fits =
      partial_ && place == partial_->next && sealed.size() == std::min(partial_->payload.size() - partial_->filled, kSealedPartBytes);
  scratch.resize(kSealedPartBytes);
  std::byte* const to = fits ? partial_->payload.data() + partial_->filled : scratch.data();
  cipher_->Begin(place.message, frame.data(), to);
  if (!sealed.empty()) cipher_->Pass(sealed);
  if (!cipher_->TagFits(sealed.data() + sealed.size())) return Forged{};
  last_ = place;

  if (fits) {
    partial_->filled += sealed.size();
    ++partial_->next.frame;
  } else {
    partial_.reset();
    if (!first || !Begin(std::span<const std::byte>(scratch).first(sealed.size()), place)) return More{};
  }
  if (partial_->filled < partial_->payload.size()) return More{};
  return Take();
}

// False: the sizes are no sender's of ours, or too large; the message is dropped.
bool Unsealer::Begin(std::span<const std::byte> plain, Place place) {
  if (plain.size() < kSealedSizesBytes) return false;
  const auto header_bytes = LoadLittle<std::uint32_t>(Raw(plain.data()));
  const auto payload_bytes = LoadLittle<std::uint64_t>(Raw(plain.data()) + 4);
  plain = plain.subspan(kSealedSizesBytes);
  if (header_bytes > plain.size() || payload_bytes > max_payload_bytes_) return false;
  const std::span<const std::byte> rest = plain.subspan(header_bytes);
  if (rest.size() != std::min<std::uint64_t>(payload_bytes, kMaxSealedHeaderBytes - header_bytes)) return false;
  Partial& partial = partial_.emplace(Partial{});  // clang 14 refuses emplace() for a struct whose members have defaults
  partial.header = Bytes(std::vector<std::byte>(plain.begin(), plain.begin() + std::ptrdiff_t(header_bytes)));
  partial.payload.resize(payload_bytes);
  std::ranges::copy(rest, partial.payload.begin());
  partial.filled = rest.size();
  partial.next = {place.message, 1};
  return true;
}

Unsealer::Message Unsealer::Take() {
  Message message = {std::move(partial_->header)};
  if (!partial_->payload.empty()) message.emplace_back(std::move(partial_->payload));
  partial_.reset();
  return message;
}

}  // namespace slabstream
