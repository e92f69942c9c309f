// Base64 (RFC 4648): four letters stand for three bytes.
//
// Pure. Any thread.
#pragma once

#include <cstddef>
#include <optional>
#include <span>

namespace slabstream {

// What a letter stands for, in [0, 64); -1: it is none.
int Base64Digit(char letter);

// Writes what whole groups of four letters stand for, and tells how many bytes these are: three a group; one or two less if the last group
// ends in = or ==. `out` has room for three bytes a group. Nothing: a part of a group, or something that is no letter, such as a blank.
std::optional<std::size_t> DecodeBase64(std::span<const std::byte> letters, std::span<std::byte> out);

}  // namespace slabstream
