// The machine that a figure was measured on, and the memory that measuring took.
#pragma once

#include <cstdint>
#include <string>

namespace slabstream {

struct MachineInfo {
  std::string cpu;   // "AMD EPYC 7763 64-Core Processor"; empty if the system does not tell
  std::string simd;  // the instruction set that the kernels run on: "avx512"
  int cores = 0;     // that this process may use
};
MachineInfo DescribeMachine();

// Peak of this process's resident memory since the last ResetPeakMemory, or since its start if the system cannot reset it. 0: unknown.
void ResetPeakMemory();  // first returns free memory to the system
std::int64_t PeakMemoryBytes();

}  // namespace slabstream
