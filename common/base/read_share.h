// ReadShare: how far a long read has come, and how fast it is.
#pragma once

#include <cstdint>

namespace slabstream {

struct ReadShare {
  int percent = 0;                     // how much of the samples is read, [0, 100]; 0: not known
  std::uint64_t bytes_per_second = 0;  // bytes of samples that are read in a second
};

}  // namespace slabstream
