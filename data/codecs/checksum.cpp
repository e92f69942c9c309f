#include <zlib.h>

#include <algorithm>

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

class Checked : public ChunkCodec {
 public:
  Checked(Checksum checksum, bool in_front) : checksum_(checksum), in_front_(in_front) {}

  Result<Bytes> Decode(Bytes packed, std::uint64_t most) const override {
    const std::string_view name = NameOf(checksum_);
    Result<SummedBytes> summed = TakeSum(name, std::move(packed), most, in_front_);
    if (!summed.ok()) return summed.status();
    const std::uint32_t sum = SumOf(checksum_, summed->bytes.span());
    if (summed->sum == sum) return std::move(summed->bytes);
    return Status::DataLoss(fmt::format("damaged: its {} is {:08x}, stated is {:08x}", name, sum, summed->sum));
  }

 private:
  const Checksum checksum_;
  const bool in_front_;
};

}  // namespace

SharedCodec ChecksumCodec(Checksum checksum, bool in_front) { return std::make_shared<Checked>(checksum, in_front); }

}  // namespace slabstream
