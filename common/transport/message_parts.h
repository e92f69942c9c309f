// Parts of ZeroMQ messages that share their memory with Bytes. Private to this folder.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <zmq.hpp>

#include "common/memory/bytes.h"

namespace slabstream {

// A message that shares the bytes and releases them when ZeroMQ has sent it, on any thread. `held`, if any, counts them until then.
using HeldBytes = std::shared_ptr<std::atomic<std::uint64_t>>;
zmq::message_t Share(Bytes bytes, HeldBytes held = nullptr);

// The memory of a received message as Bytes.
Bytes Adopt(zmq::message_t message);

// 0, or the error number; EAGAIN: the high-water mark is reached. Waits for nothing.
int SendPart(zmq::socket_t& socket, zmq::message_t message, bool more);

// False: nothing is there. Waits for nothing.
bool ReceivePart(zmq::socket_t& socket, zmq::message_t& message);

}  // namespace slabstream
