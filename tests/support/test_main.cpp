// main() of every test program: GoogleTest's, under the instruction set that SLABSTREAM_SIMD asks for. Exit status 77: all were skipped.
#include <gmock/gmock.h>

#include <cstdio>

#include "common/kernels/simd_target.h"

int main(int argc, char** argv) {
  testing::InitGoogleMock(&argc, argv);
  if (const slabstream::Status status = slabstream::LimitSimdTargetByEnvironment(); !status.ok()) {
    (void)std::fprintf(stderr, "%s\n", status.message().c_str());
    return 2;
  }
  const int status = RUN_ALL_TESTS();
  const testing::UnitTest& all = *testing::UnitTest::GetInstance();
  const bool skipped = all.skipped_test_count() > 0 && all.skipped_test_count() == all.test_to_run_count();
  return status == 0 && skipped ? 77 : status;
}
