#include "data/sources/chosen_channel.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstddef>

#include "common/base/printable.h"

namespace slabstream {

Result<int> ChosenChannel(const std::string& path, const std::vector<std::string>& channels, const ReadOptions& options) {
  const int channel = options.channel.value_or(channels.size() == 1 ? 0 : -1);
  if (channel >= 0 && std::size_t(channel) < channels.size()) return channel;
  if (channels.size() < 2) return Status::InvalidArgument(path + ": has 1 channel, so channel must be 0");
  std::string names;
  for (std::size_t i = 0; i < channels.size(); ++i) {
    names += fmt::format("{}{}{}", names.empty() ? "" : ", ", i, channels[i].empty() ? "" : ": " + channels[i]);
  }
  return Status::InvalidArgument(fmt::format("{}: has {} channels, of which --channel takes one: 0 to {} ({})", path, channels.size(),
                                             channels.size() - 1, Printable(names)));
}

}  // namespace slabstream
