// What other times of a source hold, so that a picture of one time is drawn with the range and the histogram of all of them.
#pragma once

#include <string>
#include <vector>

#include "common/volume/summary.h"
#include "data/sources/volume_source.h"

namespace slabstream {

// Surveys up to kMostOtherTimes times of a source beside the one that it shows, spread evenly over all of them with the first and the last;
// of each a coarse level or a sample. None: the source has one time, its text names one, it holds labels, or each time of it costs too much
// to read: it can only be read in one order or as a whole, and all of it takes more than 256 MiB. What cannot be read is left out; a line
// of the log tells. `source`: its text. `beside`: what is open of it (OpenSource); null: nothing. Waits.
inline constexpr int kMostOtherTimes = 8,
                     kFewOtherTimes = 2;  // few: behind an address, or where each opens all files or reads all before it
std::vector<VolumeSummary> SurveyOtherTimes(const std::string& source, const SourceInfo& info, VolumeSource* beside);

}  // namespace slabstream
