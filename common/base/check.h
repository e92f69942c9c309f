// CHECK: for our own mistakes only. A failed check prints file, line, the condition, both operands where there are two,
// what was streamed in, and aborts. Bad input from outside is a Status (status.h), never a CHECK.
//
//   CHECK(ready) << "while rendering group " << g;
//   CHECK_LE(begin, end);
#pragma once

#include <sstream>

namespace slabstream::internal {

class CheckFailure {
 public:
  CheckFailure(const char* file, int line, const char* condition);
  CheckFailure(const CheckFailure&) = delete;
  CheckFailure& operator=(const CheckFailure&) = delete;
  [[noreturn]] ~CheckFailure();
  std::ostream& stream() { return stream_; }

 private:
  std::ostringstream stream_;
};

// Gives both arms of the conditional in CHECK the type void.
struct Voidify {
  void operator&(std::ostream&) const {}
};

}  // namespace slabstream::internal

#define CHECK(condition)             \
  (condition) ? static_cast<void>(0) \
              : ::slabstream::internal::Voidify() & ::slabstream::internal::CheckFailure(__FILE__, __LINE__, #condition).stream()

#define SLABSTREAM_CHECK_OP(a, op, b) CHECK((a)op(b)) << "(" << (a) << " against " << (b) << ") "
#define CHECK_EQ(a, b) SLABSTREAM_CHECK_OP(a, ==, b)
#define CHECK_NE(a, b) SLABSTREAM_CHECK_OP(a, !=, b)
#define CHECK_LT(a, b) SLABSTREAM_CHECK_OP(a, <, b)
#define CHECK_LE(a, b) SLABSTREAM_CHECK_OP(a, <=, b)
#define CHECK_GT(a, b) SLABSTREAM_CHECK_OP(a, >, b)
#define CHECK_GE(a, b) SLABSTREAM_CHECK_OP(a, >=, b)
