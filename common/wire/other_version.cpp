#include "common/wire/other_version.h"

#include "common/base/check.h"
#include "common/wire/any_message.h"
#include "slabstream/v1/envelope.pb.h"

namespace slabstream {

std::optional<std::uint32_t> OtherVersion(std::span<const std::byte> header) {
  v1::Envelope envelope;
  if (header.size() > kMaxHeaderBytes || !envelope.ParseFromArray(header.data(), static_cast<int>(header.size()))) return std::nullopt;
  if (envelope.version() == 0 || envelope.version() == kWireVersion) return std::nullopt;
  return envelope.version();
}

std::vector<std::byte> VersionNotice() {
  v1::Envelope envelope;
  envelope.set_version(kWireVersion);
  std::vector<std::byte> header(envelope.ByteSizeLong());
  CHECK(envelope.SerializeToArray(header.data(), static_cast<int>(header.size())));
  return header;
}

std::string TextOfOtherVersion(std::uint32_t other) {
  return "speaks version " + std::to_string(other) + " of the wire protocol, this program version " + std::to_string(kWireVersion) +
         ": both must be of the same release";
}

}  // namespace slabstream
