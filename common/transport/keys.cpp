#include "common/transport/keys.h"

#include <zmq.h>

#include <array>
#include <cstdint>

#include "common/base/check.h"

namespace slabstream {
namespace {

constexpr std::size_t kTextBytes = 40, kRawKeyBytes = 32;
using Text = std::array<char, kTextBytes + 1>;  // with the closing zero

}  // namespace

KeyPair MakeKeyPair() {
  Text public_key{}, secret_key{};
  do {
    CHECK_EQ(zmq_curve_keypair(public_key.data(), secret_key.data()), 0) << "ZeroMQ was built without CURVE";
  } while (public_key.front() == '-');
  return {public_key.data(), secret_key.data()};
}

bool IsKey(std::string_view text) {
  std::array<std::uint8_t, kRawKeyBytes> bytes{};
  return text.size() == kTextBytes && zmq_z85_decode(bytes.data(), std::string(text).c_str()) != nullptr;
}

std::optional<std::string> PublicKeyOf(const std::string& secret_key) {
  Text public_key{};
  if (!IsKey(secret_key) || zmq_curve_public(public_key.data(), secret_key.c_str()) != 0) return std::nullopt;
  return public_key.data();
}

std::string IdOfKey(const std::string& public_key) {
  std::array<std::uint8_t, kRawKeyBytes> bytes{};
  if (!IsKey(public_key)) return "";
  zmq_z85_decode(bytes.data(), public_key.c_str());
  constexpr char kDigits[] = "0123456789abcdef";
  std::string id;
  for (std::size_t i = 0; i < 4; ++i) {
    id += kDigits[bytes[i] / 16];
    id += kDigits[bytes[i] % 16];
  }
  return id;
}

}  // namespace slabstream
