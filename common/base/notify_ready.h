// Tells the supervisor that started this process that it is ready: sd_notify(3), without its library.
#pragma once

namespace slabstream {

// Sends READY=1 to the socket that $NOTIFY_SOCKET names. Without that variable, or without somebody who listens there, nothing happens.
void NotifyReady();

}  // namespace slabstream
