// The progress of frames and of reading, in words.
#pragma once

#include <string>

#include "common/base/read_share.h"
#include "common/wire/client_messages.h"

namespace slabstream {

// "queued, 2 before it", "reading scan.nii.gz: 45 % (310 MiB/s)", "3 of 7 groups, 4 workers, attempt 2".
std::string Describe(const FrameProgress& progress, const std::string& source);
// "reading scan.nii.gz: 45 % (310 MiB/s)". `source`: a path with options, or the name of a dataset.
std::string Describe(const ReadShare& read, const std::string& source);

}  // namespace slabstream
