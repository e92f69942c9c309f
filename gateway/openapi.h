// The gateway's interface as an OpenAPI 3.0 document. Options come from the declarations that requests are parsed by.
#pragma once

#include "client/request/json_value.h"

namespace slabstream {

Json OpenApi();

}  // namespace slabstream
