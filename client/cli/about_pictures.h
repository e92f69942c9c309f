// What a command asks the service about its pictures: what to warn of.
#pragma once

#include <optional>
#include <string>

#include "client/client.h"
#include "client/report/picture_warnings.h"
#include "client/request/value_window.h"
#include "common/cli/program.h"

namespace slabstream {

// One line if the picture shows nothing (`empty`), or if --window (`window`) or --scalar-range meets none of the volume's values. No
// picture fails for want of it.
inline void WarnOf(Client& client, const FrameRequest& frame, bool empty, const std::optional<ValueWindow>& window = {}) {
  const std::optional<ScalarRange>& range = frame.transfer.scalar_range;
  if (!empty && !window && !range) return;
  const Result<SummaryReply> summary = client.Summarize(SummaryOf(frame));
  if (!summary.ok()) return;
  std::optional<std::string> warning;
  if (window) {
    warning = RangeWarning("--window", window->low(), window->high(), summary->range);
  } else if (range && !range->percentiles) {
    warning = RangeWarning("--scalar-range", range->min, range->max, summary->range);
  }
  if (!warning && empty) warning = EmptyWarning(frame, *summary);
  if (warning) PrintWarning(*warning);
}

}  // namespace slabstream
