// The control plane, with processes that own voxels (DEALER).
//
//   owner                                coordinator
//   RegisterOwner -------------------->            every second until OwnerWelcome or OwnerRefused
//                 <--------------------  OwnerWelcome
//   OwnerTime     -------------------->            its boxes are whole at this time
//   OwnerPing     -------------------->            every heartbeat interval, and to learn what is used; OwnerPong answers
//                 <--------------------  OwnerPong
//                 <--------------------  OwnerSteered    what its parameters are now
//                 <--------------------  ChunkRequest    samples of a box at a time, as they are held
//   Chunk + payload or ChunkRefused -->            Unavailable: it holds another time now
//   OwnerLeave    -------------------->            an owner ends now
//                 <--------------------  Retire          you are not (or no longer) known: register again
#pragma once

#include <variant>

#include "common/base/merged.h"
#include "common/wire/control_messages.h"
#include "common/wire/owners_structs.h"
#include "common/wire/voxel_messages.h"

namespace slabstream {

using OwnerMessage = std::variant<RegisterOwner, OwnerWelcome, OwnerTime, OwnerPing, OwnerPong, OwnerLeave, OwnerRefused, OwnerSteered>;
using OwnerToCoordinator = std::variant<RegisterOwner, OwnerTime, OwnerPing, OwnerLeave, Chunk, ChunkRefused>;
using CoordinatorToOwner = std::variant<OwnerWelcome, OwnerPong, OwnerRefused, OwnerSteered, Retire, ChunkRequest>;
// What comes to the coordinator's control plane.
using ToControl = Merged<WorkerToCoordinator, OwnerToCoordinator>;

}  // namespace slabstream
