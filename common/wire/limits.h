// Limits of messages that no struct's header states. Others stand beside the structs: kMaxNameBytes, kMaxTextBytes, kMaxEndpointBytes,
// kMaxReports, ...
#pragma once

#include <cstddef>
#include <cstdint>

#include "common/combining/schedule.h"
#include "common/view/camera.h"

namespace slabstream {

inline constexpr std::uint32_t kMaxFrameSide = std::uint32_t{kMaxImageSide} * kMaxSupersample;  // pixels of the finest frame, 2^24
inline constexpr std::uint64_t kMaxFramePixels = std::uint64_t{kMaxFrameSide} * kMaxFrameSide;  // 2^48
inline constexpr std::uint64_t kMaxRunsBytes = std::uint64_t{2} << 30;                          // bytes of one image, unpacked
inline constexpr std::size_t kMaxPeers = std::size_t{kMaxRanks} + 1;                            // a worker a rank, and the display
inline constexpr std::size_t kMaxListed = 65536;  // workers or datasets of a StatusReply, keys of a KeysReply
inline constexpr std::size_t kKeyTextBytes = 40;  // a public key (common/transport/keys.h)

}  // namespace slabstream
