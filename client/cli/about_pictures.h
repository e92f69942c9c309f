// What a command asks the service about its pictures: their key, and what to warn of.
#pragma once

#include <optional>
#include <string>

#include "client/client.h"
#include "client/pictures/picture_writer.h"
#include "client/report/picture_warnings.h"
#include "client/request/key_of_picture.h"
#include "client/request/value_window.h"
#include "common/cli/program.h"

namespace slabstream {

// What annotations of pictures like that of `request` need. Empty if they need nothing.
inline Result<PictureKey> KeyFor(Client& client, const Annotations& annotations, const FrameRequest& request) {
  if (!annotations.needs_key()) return PictureKey();
  const Result<SummaryReply> summary = client.Summarize(SummaryOf(request));
  if (!summary.ok()) return summary.status();
  return KeyOf(request, *summary);
}

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
