#include "common/base/check.h"

#include <cstdio>
#include <cstdlib>

namespace slabstream::internal {

CheckFailure::CheckFailure(const char* file, int line, const char* condition) {
  stream_ << file << ':' << line << ": check failed: " << condition << ' ';
}

CheckFailure::~CheckFailure() {
  (void)std::fprintf(stderr, "%s\n", stream_.str().c_str());
  (void)std::fflush(stderr);
  std::abort();
}

}  // namespace slabstream::internal
