// Replies of the gateway: JSON, and errors as {"error": "..."}.
#pragma once

#include <functional>
#include <string_view>

#include "client/request/json_value.h"
#include "common/base/status.h"
#include "common/http/http.h"

namespace slabstream {

using ReplyFunction = std::function<void(HttpReply)>;

HttpReply JsonReply(const Json& json);
HttpReply Failure(unsigned status, std::string_view message);
HttpReply Failure(const Status& status);  // never of Ok

}  // namespace slabstream
