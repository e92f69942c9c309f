// The control plane: coordinator (ROUTER) and workers (DEALER).
//
//   worker                               coordinator
//   Register  ------------------------>            every second until Welcome (or Refused)
//             <------------------------  Welcome
//   Heartbeat ------------------------>            every heartbeat interval; Ping answers (also sent unasked)
//             <------------------------  Ping
//             <------------------------  GroupAssignment       one message has all that a group needs: order of arrival does not matter
//   GroupDone ------------------------>            display worker only; opens the window for the next group
//   FrameImage + payload ------------->            display worker only; a preview or the finished frame. Without payload if that went
//                                                  straight to the client
//   WorkerTrouble -------------------->            something failed for this group
//   Leave     ------------------------>            a worker ends now, whatever it had to do
//             <------------------------  Retire    you are not (or no longer) known: register again
//             <------------------------  Stop      end the process
#pragma once

#include <cstddef>
#include <cstdint>
#include <variant>

#include "common/wire/control_structs.h"

namespace slabstream {

inline constexpr std::size_t kMaxEndpointBytes = 512;
inline constexpr std::int32_t kMaxOcclusionTiles = OcclusionTiles(kMaxGridSide);
inline constexpr std::size_t kMaxCancelled = 1024;  // frames in a Ping

using WorkerToCoordinator = std::variant<Register, Heartbeat, GroupDone, FrameImage, WorkerTrouble, Leave>;
using CoordinatorToWorker = std::variant<Welcome, Ping, GroupAssignment, Retire, Stop>;

}  // namespace slabstream
