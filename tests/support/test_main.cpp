// main() of every test program: GoogleTest's, under the instruction set that SLABSTREAM_SIMD asks for.
#include <gmock/gmock.h>

#include <cstdio>

#include "common/kernels/simd_target.h"

int main(int argc, char** argv) {
  testing::InitGoogleMock(&argc, argv);
  if (const slabstream::Status status = slabstream::LimitSimdTargetByEnvironment(); !status.ok()) {
    (void)std::fprintf(stderr, "%s\n", status.message().c_str());
    return 2;
  }
  return RUN_ALL_TESTS();
}
