// The state of a service, as `status` and the gateway show it.
#pragma once

#include <string>
#include <vector>

#include "common/json/json.h"
#include "common/wire/client_messages.h"

namespace slabstream {

std::string StatusText(const StatusReply& reply);  // several lines
Json StatusJson(const StatusReply& reply);

// The keys of the service, for its admins: who has one, and when it was heard last.
std::string HeardText(const AdmittedKey& key);               // "heard 3.2 s ago"
std::string KeysText(const std::vector<AdmittedKey>& keys);  // several lines
Json KeysJson(const std::vector<AdmittedKey>& keys);         // [{"id", "role", "made", "name", "silent_ms"}, ...]

}  // namespace slabstream
