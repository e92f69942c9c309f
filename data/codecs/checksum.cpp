#include <zlib.h>

#include "data/codecs/codecs.h"
#include "data/codecs/decoded_bytes.h"

namespace slabstream {
namespace {

std::string_view NameOf(Checksum checksum) {
  return checksum == Checksum::kCrc32c ? "CRC-32C" : checksum == Checksum::kCrc32 ? "CRC-32" : "Adler-32";
}

std::uint32_t SumOf(Checksum checksum, std::span<const std::byte> bytes) {
  if (checksum == Checksum::kCrc32c) return Crc32c(bytes);
  const auto* const first = reinterpret_cast<const Bytef*>(bytes.data());
  return std::uint32_t(checksum == Checksum::kCrc32 ? ::crc32_z(0, first, bytes.size()) : ::adler32_z(1, first, bytes.size()));
}

}  // namespace

SharedCodec ChecksumCodec(Checksum checksum, bool in_front) {
  return std::make_shared<ChunkCodec>([checksum, in_front](const Bytes& packed, std::uint64_t most) -> Result<Bytes> {
    const std::string_view name = NameOf(checksum);
    Result<SummedBytes> summed = TakeSum(name, packed, most, in_front);
    if (!summed.ok()) return summed.status();
    const std::uint32_t sum = SumOf(checksum, summed->bytes.span());
    if (summed->sum == sum) return std::move(summed->bytes);
    return Status::DataLoss(fmt::format("damaged: its {} is {:08x}, stated is {:08x}", name, sum, summed->sum));
  });
}

}  // namespace slabstream
