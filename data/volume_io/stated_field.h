// What files say of a channel and of times, as FieldInfo and TimeAxis have it. What makes no sense counts as not stated.
//
// Pure.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include "common/volume/field_info.h"
#include "common/volume/volume.h"

namespace slabstream {

// Of samples, as data values. None unless min < max and both data values are finite as float32, where they differ.
std::optional<ValueRange> StatedWindow(double min, double max, const ValueMapping& mapping = {});

// None unless each is in [0, 1]. Black is none, too: a channel in it could not be seen.
std::optional<std::array<float, 3>> StatedColor(double red, double green, double blue);
// 0xRRGGBB; what lies above is ignored.
std::optional<std::array<float, 3>> ColorOfBits(std::uint32_t bits);
// "00FF7f", perhaps behind #.
std::optional<std::array<float, 3>> ColorOfHex(std::string_view text);

// `count`: in [1, kMaxVolumes]. `unit`: "sec", "Milliseconds", "\u00b5s", ... A step of 1 without a unit that is known is what writers put
// where they know of none.
TimeAxis StatedTimes(std::int64_t count, std::optional<double> step, std::string_view unit);
// The step of `values`, one for each time, if these are even.
TimeAxis StatedTimes(std::int64_t count, const std::vector<double>& values, std::string_view unit);

}  // namespace slabstream
