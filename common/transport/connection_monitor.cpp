#include "common/transport/connection_monitor.h"

#include <atomic>
#include <cstdint>

namespace slabstream {

ConnectionMonitor::ConnectionMonitor(zmq::socket_t& socket, int events) {
  static std::atomic<std::uint64_t> last = 0;
  init(socket, "inproc://connection-monitor-" + std::to_string(++last), events);
}

void ConnectionMonitor::HandleEvents() {
  try {
    while (check_event()) {
    }
  } catch (const zmq::error_t&) {  // a signal: the next call goes on
  }
}

}  // namespace slabstream
