// PeerToken: the executor's name for a connection (a ROUTER identity). Never reused.
#pragma once

#include <cstdint>

namespace slabstream {

using PeerToken = std::uint64_t;

}  // namespace slabstream
