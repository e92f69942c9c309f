// What a command asks the service about its pictures: what to warn of.
#pragma once

#include <optional>

#include "client/client.h"
#include "client/request/value_window.h"

namespace slabstream {

// One line if the picture shows nothing (`empty`), or if --window (`window`) or --scalar-range meets none of the volume's values, with the
// range that would show something. No picture fails for want of it.
void WarnOf(Client& client, const FrameRequest& frame, bool empty, const std::optional<ValueWindow>& window = {});

}  // namespace slabstream
