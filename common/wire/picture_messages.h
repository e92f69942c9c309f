// The pictures plane: pictures on their way from display workers straight to a client. The client binds a ROUTER with sealed connections
// and says where with each request (SubmitFrame); display workers connect a DEALER to it. A worker that has no connection to the client
// when a picture is ready sends it through the coordinator.
#pragma once

#include <variant>

#include "common/wire/pictures_structs.h"

namespace slabstream {

using WorkerToClient = std::variant<SentPicture>;

}  // namespace slabstream
