#include "tests/common/wire/decode_any_input.h"

#include "common/base/check.h"
#include "common/wire/limits.h"

namespace slabstream {

bool DecodeAnyInput(std::span<const std::byte> input) {
  const Result<AnyMessage> message = Decode(input);
  if (!message.ok()) {
    const Status status = message.status();
    CHECK(status.code() == StatusCode::kInvalidArgument) << ToString(status.code());
    CHECK(!status.message().empty() && status.message().find('\n') == std::string::npos) << status.message();
    CHECK_LE(status.message().size(), 2048U) << status.message();
    return false;
  }
  CHECK(!NameOf(*message).empty());
  CHECK_LE(ExpectedPayloadBytes(*message), kMaxRunsBytes);
  const Result<AnyMessage> again = Decode(Encode(*message));
  CHECK(again.ok()) << again.status().message();
  CHECK(*again == *message) << NameOf(*message);
  return true;
}

}  // namespace slabstream
