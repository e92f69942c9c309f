// Guarded: an exception barrier. Libraries and the allocator throw; that must not end a thread.
#pragma once

#include <exception>
#include <new>
#include <stdexcept>
#include <string>
#include <system_error>
#include <type_traits>

#include "common/base/status.h"

namespace slabstream {

// The current exception as a Status that begins with `what`. ResourceExhausted: no memory, or none for another thread; Internal: anything
// else.
inline Status CurrentFailure(const std::string& what) {
  try {
    throw;
  } catch (const std::bad_alloc&) {
    return Status::ResourceExhausted(what + ": not enough memory");
  } catch (const std::length_error&) {  // a container larger than any memory
    return Status::ResourceExhausted(what + ": not enough memory");
  } catch (const std::system_error& error) {
    const bool no_thread = error.code() == std::errc::resource_unavailable_try_again;
    return no_thread ? Status::ResourceExhausted(what + ": not enough memory for another thread")
                     : Status::Internal(what + ": " + error.what());
  } catch (const std::exception& error) {
    return Status::Internal(what + ": " + error.what());
  } catch (...) {
    return Status::Internal(what + ": unknown exception");
  }
}

// Returns what `work` returns, a Status or Result (Ok if it returns nothing); if it throws, CurrentFailure(what).
template <class Work>
auto Guarded(const char* what, Work&& work) -> std::conditional_t<std::is_void_v<decltype(work())>, Status, decltype(work())> {
  try {
    if constexpr (std::is_void_v<decltype(work())>) {
      work();
      return Status::Ok();
    } else {
      return work();
    }
  } catch (...) {
    return CurrentFailure(what);
  }
}

}  // namespace slabstream
