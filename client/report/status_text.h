// The state of a service, as `status` and the gateway show it.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "common/wire/client_messages.h"

namespace slabstream {

std::string StatusText(const StatusReply& reply);  // several lines
nlohmann::ordered_json StatusJson(const StatusReply& reply);

}  // namespace slabstream
