// The machine that a figure was measured on, and the memory that measuring took.
#pragma once

#include <cstdint>
#include <string>

namespace slabstream {

// Texts are empty if the system does not tell.
struct MachineInfo {
  std::string cpu;       // "AMD EPYC 7763 64-Core Processor"
  std::string simd;      // the instruction set that the kernels run on: "avx512"
  int cores = 0;         // cores that this process may use
  std::string flags;     // the processor's flags: "fpu vme de ..."
  std::string kernel;    // "Linux 6.1.0-18-amd64"
  std::string governor;  // the governor of the first core's clock: "performance"
  std::string compiler;  // the compiler of this program: "GCC 12.2.0"
  double load = 0;       // mean number of threads that ran or wanted to in the last minute
};
MachineInfo DescribeMachine();

// Peak of this process's resident memory since the last ResetPeakMemory, or since its start if the system cannot reset it. 0: unknown.
void ResetPeakMemory();  // first returns free memory to the system
std::int64_t PeakMemoryBytes();

}  // namespace slabstream
