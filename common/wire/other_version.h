// Programs of different releases: who speaks another version of the protocol is told so, and told ours. Every version reads the version of
// an envelope.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace slabstream {

// The version of the program that wrote an envelope, if it is another one. nullopt: it is ours, or this is no envelope.
std::optional<std::uint32_t> OtherVersion(std::span<const std::byte> header);

// An envelope of our version without a message: what the coordinator answers to another version.
std::vector<std::byte> VersionNotice();

// "speaks version 2 of the wire protocol, this program version 3: ...". The subject stands before it.
std::string TextOfOtherVersion(std::uint32_t other);

}  // namespace slabstream
