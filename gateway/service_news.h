// What the gateway knows of the service.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "common/wire/client_messages.h"

namespace slabstream {

enum class ServiceHealth : std::uint8_t { kReady, kNoWorkers, kGone };
constexpr std::string_view NameOf(ServiceHealth health) {
  return health == ServiceHealth::kReady ? "ready" : health == ServiceHealth::kNoWorkers ? "no-workers" : "gone";
}

struct ServiceNews {
  ServiceHealth health = ServiceHealth::kGone;
  std::string reason = "not asked yet";  // empty if it is ready
  StatusReply status;                    // the last answer, kept when the service is gone
};

}  // namespace slabstream
