// Identities, limits and small values that messages are made of.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

#include "common/planning/worker_id.h"

namespace slabstream {

using Epoch = std::uint64_t;        // random; one coordinator incarnation
using Incarnation = std::uint64_t;  // random; one registration of a worker process: what it held before is gone
using RequestId = std::uint64_t;    // chosen by the client, unique within its connection
using FrameId = std::uint64_t;      // ascending within an epoch
using ClientId = std::uint64_t;     // whom a frame is for, within an epoch

inline constexpr std::size_t kMaxTextBytes = 4096;  // of an error
inline constexpr std::uint32_t kMaxThreads = 1024;  // of one worker
inline constexpr std::size_t kMaxReports = 65536;   // of a message

// One group of one attempt at a frame. A re-plan raises `attempt`; messages of an older attempt are dropped.
struct GroupKey {
  FrameId frame = 0;
  std::uint32_t attempt = 0;
  std::uint32_t group = 0;
  friend bool operator==(const GroupKey&, const GroupKey&) = default;
  friend auto operator<=>(const GroupKey&, const GroupKey&) = default;
};

// The slot that a worker owns, among how many.
struct SlotPlace {
  std::uint32_t slot = 0;
  std::uint32_t slots = 0;  // 0: it owns none
  friend bool operator==(const SlotPlace&, const SlotPlace&) = default;
};

// A label of a dataset that a client sends.
struct NewLabel {
  std::uint64_t value = 1;                         // at least 1
  std::string name = {};                           // at most kMaxLabelNameBytes
  std::optional<std::array<float, 3>> color = {};  // straight, [0, 1]; none: StandardColor
  friend bool operator==(const NewLabel&, const NewLabel&) = default;
};

}  // namespace slabstream
