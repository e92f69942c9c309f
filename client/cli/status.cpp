#include "client/report/status_text.h"

#include <iostream>
#include <nlohmann/json.hpp>

#include "client/cli/commands.h"
#include "client/cli/session.h"

namespace slabstream {

Status RunStatus(const StatusOptions& options) {
  Result<Session> session = Session::OpenService(options.service);
  if (!session.ok()) return session.status();
  const Result<StatusReply> reply = session->client().QueryStatus();
  if (!reply.ok()) return reply.status();
  std::cout << (options.json ? StatusJson(*reply).dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n"
                             : StatusText(*reply));
  return Status::Ok();
}

}  // namespace slabstream
