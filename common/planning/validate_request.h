// Checks a request before anything uses it.
#pragma once

#include "common/base/status.h"
#include "common/frame/frame_request.h"

namespace slabstream {

// InvalidArgument naming field, value and limit. Names of the policy are looked up later (CheckNames).
Status Validate(const FrameRequest& request);
Status Validate(const TransferChoice& transfer);

}  // namespace slabstream
