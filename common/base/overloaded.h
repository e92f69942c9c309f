// Overloaded: one function object out of several, for std::visit.
#pragma once

namespace slabstream {

template <class... Functions>
struct Overloaded : Functions... {
  using Functions::operator()...;
};

}  // namespace slabstream
