// Overloaded: one function object out of several, for std::visit.
#pragma once

namespace slabstream {

template <class... Functions>
struct Overloaded : Functions... {
  using Functions::operator()...;
};
template <class... Functions>  // C++20 deduces this for an aggregate; clang 14, the parser of clang-tidy, does not yet
Overloaded(Functions...)->Overloaded<Functions...>;

}  // namespace slabstream
