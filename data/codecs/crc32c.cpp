// The polynomial is Castagnoli's, with reflected bits. Eight bytes at a time ("slicing by 8", Kounavis and Berry 2005): table k holds the
// remainders of a byte with k zero bytes behind it.
#include <array>

#include "data/codecs/codecs.h"
#include "data/codecs/decoded_bytes.h"

namespace slabstream {
namespace {

constexpr std::size_t kStep = 8;
using Remainders = std::array<std::array<std::uint32_t, 256>, kStep>;

constexpr Remainders MakeRemainders() {
  Remainders remainders{};
  constexpr std::uint32_t kPolynomial = 0x82f63b78;
  for (std::uint32_t byte = 0; byte < 256; ++byte) {
    std::uint32_t remainder = byte;
    for (int bit = 0; bit < 8; ++bit) remainder = (remainder >> 1) ^ ((remainder & 1) != 0 ? kPolynomial : 0);
    remainders[0][byte] = remainder;
  }
  for (std::size_t zeros = 1; zeros < kStep; ++zeros) {
    for (std::size_t byte = 0; byte < 256; ++byte) {
      const std::uint32_t shorter = remainders[zeros - 1][byte];
      remainders[zeros][byte] = (shorter >> 8) ^ remainders[0][shorter & 0xff];
    }
  }
  return remainders;
}
constexpr Remainders kRemainders = MakeRemainders();

}  // namespace

std::uint32_t Crc32c(std::span<const std::byte> bytes) {
  std::uint32_t remainder = ~std::uint32_t{0};
  for (; bytes.size() >= kStep; bytes = bytes.subspan(kStep)) {
    const std::uint32_t low = Little32(bytes) ^ remainder, high = Little32(bytes.subspan(4));
    remainder = kRemainders[7][low & 0xff] ^ kRemainders[6][(low >> 8) & 0xff] ^ kRemainders[5][(low >> 16) & 0xff] ^
                kRemainders[4][low >> 24] ^ kRemainders[3][high & 0xff] ^ kRemainders[2][(high >> 8) & 0xff] ^
                kRemainders[1][(high >> 16) & 0xff] ^ kRemainders[0][high >> 24];
  }
  for (const std::byte byte : bytes)
    remainder = (remainder >> 8) ^ kRemainders[0][(remainder ^ std::to_integer<std::uint32_t>(byte)) & 0xff];
  return ~remainder;
}

}  // namespace slabstream
