// What a Context holds. Private to this folder.
#pragma once

#include <memory>
#include <mutex>
#include <zmq.hpp>

#include "common/transport/authenticator.h"
#include "common/transport/context.h"

namespace slabstream {

struct Context::Impl {
  zmq::context_t context{1};  // one I/O thread moves 4 to 6 GB/s, more than a machine's workers make
  std::mutex mutex;
  std::unique_ptr<Authenticator> authenticator;  // guarded by mutex
};

}  // namespace slabstream
