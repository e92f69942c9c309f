// Printable: what users may be shown of messages that quote files and other processes, which may hold anything.
#pragma once

#include <string>

#include "common/base/status.h"

namespace slabstream {

inline constexpr std::size_t kMaxPrintableBytes = 1024;

// One line: control characters become '?', and a text of more than kMaxPrintableBytes keeps its beginning and its end.
std::string Printable(std::string text);
Status Printable(const Status& status);

}  // namespace slabstream
