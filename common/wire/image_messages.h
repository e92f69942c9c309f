// The images plane: partial images between workers. Every worker binds a ROUTER; a sender connects a DEALER to it.
#pragma once

#include <cstddef>
#include <variant>

#include "common/wire/images_structs.h"

namespace slabstream {

// Payloads with fewer bytes are not acknowledged: they measure a link's latency rather than its rate.
inline constexpr std::size_t kLeastAcknowledgedBytes = std::size_t{64} << 10;

using WorkerToWorker = std::variant<PartialImage, ImageRefused, ImageReceived, ShapeTiles>;

}  // namespace slabstream
