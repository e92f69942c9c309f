// Variants of several variants' types.
#pragma once

#include <utility>
#include <variant>

namespace slabstream {

template <class Variant, class... Variants>
struct Merge {
  using Type = Variant;
};
template <class... A, class... B, class... Variants>
struct Merge<std::variant<A...>, std::variant<B...>, Variants...> : Merge<std::variant<A..., B...>, Variants...> {};

// One variant of all that these variants may hold.
template <class... Variants>
using Merged = typename Merge<Variants...>::Type;

// The same value in a variant of more types.
template <class Wider>
Wider Widen(auto variant) {
  return std::visit([](auto& held) { return Wider(std::move(held)); }, variant);
}

}  // namespace slabstream
