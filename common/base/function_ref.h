// FunctionRef<R(Arguments...)>: a reference to anything that can be called so. It takes no memory, and what it refers to must outlive it:
// it is meant for parameters.
#pragma once

#include <concepts>
#include <memory>
#include <type_traits>
#include <utility>

namespace slabstream {

template <class Signature>
class FunctionRef;

template <class R, class... Arguments>
class FunctionRef<R(Arguments...)> {
 public:
  template <class Function>
  requires(!std::same_as<std::remove_cvref_t<Function>, FunctionRef> && std::is_object_v<std::remove_reference_t<Function>> &&
           std::is_invocable_r_v<R, Function&, Arguments...>)
      FunctionRef(Function&& function)  // NOLINT(*-constructor,*-overload): what is called is passed as it is
      : function_(const_cast<void*>(static_cast<const void*>(std::addressof(function)))),
        call_([](void* object, Arguments... arguments) -> R {
          auto& called = *static_cast<std::remove_reference_t<Function>*>(object);
          if constexpr (std::is_void_v<R>) {
            called(std::forward<Arguments>(arguments)...);
          } else {
            return called(std::forward<Arguments>(arguments)...);
          }
        }) {}

  R operator()(Arguments... arguments) const { return call_(function_, std::forward<Arguments>(arguments)...); }

 private:
  void* function_;
  R (*call_)(void*, Arguments...);
};

}  // namespace slabstream
