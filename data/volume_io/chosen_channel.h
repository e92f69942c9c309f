// Which channel of an image is shown. The channels of an image are volumes of their own, such as dyes; the components of a voxel, such as
// red, green and blue, are not (raw_volume.h).
//
// Pure.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "common/base/status.h"
#include "common/volume/field_info.h"
#include "data/volume_io/read_options.h"

namespace slabstream {

inline constexpr std::size_t kMostChannels = 65536;  // channels of an image: as many as ReadOptions::channel can tell apart

// The one that the options take, else the first one: in [0, channels.size()). `channels`: all, at least one. InvalidArgument, naming `path`
// and the channels: the options take one that is not there.
Result<int> ChosenChannel(const std::string& path, const std::vector<FieldInfo>& channels, const ReadOptions& options);

// A line for people who did not say which of several channels they want: which one is shown. None: they did, or there is one.
std::optional<std::string> ShownChannelText(const std::string& path, const std::vector<FieldInfo>& channels, int shown,
                                            const ReadOptions& options);

}  // namespace slabstream
