#include "data/sources/space_axes.h"

#include <fmt/format.h>

#include <cstddef>

#include "data/volume_io/raw_volume.h"

namespace slabstream {

Result<SpaceAxes> LastAxesAreSpace(const std::string& named, const std::vector<std::uint64_t>& size, const ReadOptions& options) {
  constexpr std::size_t kSpaceAxes = 3;
  const auto refused = [&](const std::string& why) { return Status::InvalidArgument(named + ": " + why); };
  if (size.size() < 2) return refused("has 1 axis, must have at least 2");
  if (options.channel.value_or(0) != 0) return refused("has 1 channel, so channel must be 0");
  SpaceAxes space{.at = std::vector<std::uint64_t>(size.size(), 0)};
  for (std::size_t axis = 0; axis < kSpaceAxes && axis < size.size(); ++axis) space.axes[axis] = int(size.size() - 1 - axis);
  std::size_t time_axis = 0;
  std::uint64_t times = 1;
  for (std::size_t axis = 0; axis + kSpaceAxes < size.size(); ++axis) {
    if (size[axis] == 1) continue;
    if (times > 1) {
      return refused(
          fmt::format("is of {}: only one axis before the last three, which are z, y and x, may be longer than 1", fmt::join(size, " x ")));
    }
    if (size[axis] > std::uint64_t{kMaxVolumes}) return refused(fmt::format("has {} times, must have at most {}", size[axis], kMaxVolumes));
    time_axis = axis;
    times = size[axis];
  }
  const Result<std::int64_t> time = ChosenVolume(named, std::int64_t(times), options);
  if (!time.ok()) return time.status();
  if (size.size() > kSpaceAxes) space.at[time_axis] = std::uint64_t(*time);
  space.times = int(times);
  return space;
}

}  // namespace slabstream
