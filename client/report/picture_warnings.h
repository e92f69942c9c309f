// What a user should know of a picture that shows nothing, or one colour only: one line, with the range that would show something. Pure.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "common/frame/frame_request.h"
#include "common/wire/client_messages.h"

namespace slabstream {

// Colours from `low` to `high` (data values), as `option` says, meet none of the volume's values. Nothing: they do.
std::optional<std::string> RangeWarning(std::string_view option, double low, double high, const ValueRange& values);

// Why the picture of `frame` is empty. `summary`: of its dataset, under its transfer function.
std::string EmptyWarning(const FrameRequest& frame, const SummaryReply& summary);

}  // namespace slabstream
