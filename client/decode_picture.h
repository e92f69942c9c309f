// From the reply of a service to the picture that a caller gets.
#pragma once

#include <vector>

#include "client/client.h"
#include "common/base/status.h"
#include "common/memory/bytes.h"
#include "common/wire/client_messages.h"

namespace slabstream {

// Checks a reply and makes the picture of its shares. Anybody may answer at the endpoint, so nothing in the reply is trusted. `runs`: those
// of each share, packed as the share's header says. Moves the statistics out of the reply, and fills in all but Picture::latency.
// DataLoss: the size is not the one that `asked` has, or runs are damaged.
Result<Picture> DecodePicture(FrameReply& reply, const std::vector<Bytes>& runs, const FrameRequest& asked);

}  // namespace slabstream
