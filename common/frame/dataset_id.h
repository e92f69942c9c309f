#pragma once

#include <cstdint>

namespace slabstream {

using DatasetId = std::uint64_t;  // a volume under a name: the same in every coordinator's life, another one for other voxels. 0: none

}  // namespace slabstream
