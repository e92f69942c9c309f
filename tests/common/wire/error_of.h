// What decoding tells about a message that a test has altered.
#pragma once

#include <string>

#include "common/wire/any_message.h"
#include "slabstream/v1/envelope.pb.h"

namespace slabstream {

// "": nothing is wrong with it.
inline std::string ErrorOf(const v1::Envelope& envelope) {
  const std::string bytes = envelope.SerializeAsString();
  return Decode({reinterpret_cast<const std::byte*>(bytes.data()), bytes.size()}).status().message();
}

}  // namespace slabstream
