// Which service a program is a client of: its options.
#pragma once

#include <string>

#include "common/cli/add_option.h"

namespace slabstream {

// Which service: see ResolveService (service_state.h).
struct ServiceChoice {
  std::string endpoint, file;  // both: the file's keys, and this endpoint instead of its own; none: the usual service
  const std::string& text() const { return file.empty() ? endpoint : file; }
};

// For AddParsed: an endpoint, as ParseEndpoint takes it.
ParseText EndpointText(bool allow_wildcard);
// --endpoint and --service; returns the former.
Option AddService(const Command& app, ServiceChoice& service);

}  // namespace slabstream
