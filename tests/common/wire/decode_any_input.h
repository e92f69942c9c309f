// What must hold for every input of Decode, be it what it may. Also the body of a fuzz target.
#pragma once

#include <cstddef>
#include <span>

#include "common/wire/any_message.h"

namespace slabstream {

// Decodes `input` and CHECKs: an error is one line of InvalidArgument; a message encodes, decodes to the same again, and has a payload
// within the limits. Returns whether it was a message.
bool DecodeAnyInput(std::span<const std::byte> input);

}  // namespace slabstream
