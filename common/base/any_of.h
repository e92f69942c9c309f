// AnyOf<M, A, B, ...>: M is one of A, B, ...
#pragma once

#include <concepts>

namespace slabstream {

template <class M, class... Ms>
concept AnyOf = (std::same_as<M, Ms> || ...);

}  // namespace slabstream
