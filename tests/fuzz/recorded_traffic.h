// Messages as a running service sends them: seeds that hold together, which samples made by hand do not.
#pragma once

#include <cstddef>
#include <vector>

namespace slabstream {

// Headers of what a client and a worker send and are sent while a frame is made.
std::vector<std::vector<std::byte>> RecordedHeaders();

}  // namespace slabstream
