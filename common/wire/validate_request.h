// Checks a request before anything uses it: the one place. The limits of single values are those of the schema.
#pragma once

#include "common/base/status.h"
#include "common/frame/frame_request.h"

namespace slabstream {

// InvalidArgument naming field, value and limit, or as RenderersFor. Names of the policy are looked up later (CheckNames).
Status Validate(const FrameRequest& request);

// The same of its parts.
Status Validate(const TransferChoice& transfer);
Status Validate(const ViewParameters& view);
Status Validate(const ImageSize& size);
Status Validate(const Clipping& clipping);
Status Validate(const Shading& shading);

}  // namespace slabstream
