// Embedded services of the laboratory: workers of one render thread each, and a client that times their frames.
#pragma once

#include <memory>
#include <vector>

#include "client/cli/service_connection.h"
#include "common/base/time.h"
#include "common/volume/volume.h"

namespace slabstream {

// A service with these volumes; dataset(i) is the i-th. Fails with the service.
Result<ServiceConnection> OpenLabService(int workers, const std::vector<std::shared_ptr<const Volume>>& volumes);

struct TimedPicture {
  Time submitted, received;  // at the client, on the clock of the spans
  Picture picture;
};
// One frame at a time. Fails with the frame.
Result<TimedPicture> RenderTimed(Client& client, const FrameRequest& request);

}  // namespace slabstream
