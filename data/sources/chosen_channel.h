// Which channel of a source the options take.
#pragma once

#include <string>
#include <vector>

#include "common/base/status.h"
#include "data/volume_io/read_options.h"

namespace slabstream {

// In [0, channels.size()). InvalidArgument: the options take none although there are several, or one that is not there. The message names
// the channels.
Result<int> ChosenChannel(const std::string& path, const std::vector<std::string>& channels, const ReadOptions& options);

}  // namespace slabstream
