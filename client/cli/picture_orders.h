// PictureOrder: what `render` makes of one SOURCE. With several of them, the names of files have a place for the name of the source:
// {name}.
#pragma once

#include <string>
#include <vector>

#include "client/cli/options.h"
#include "common/base/status.h"

namespace slabstream {

inline constexpr char kNamePlace[] = "{name}";

struct PictureOrder {
  FrameOptions frame;
  std::string output;
};

// One for each source, in their order; {name} in --output, --stats, --trace and --save-camera is the source's name: a dataset's own, or a
// file's without its endings, of letters, digits, '.', '_' and '-' ("brain" of "scans/brain.nii.gz", "fmri@3" of "fmri.nii?time=3").
// InvalidArgument, if there are several sources: a file's name has no such place, or two sources have the same name.
Result<std::vector<PictureOrder>> PictureOrders(const RenderOptions& options);

}  // namespace slabstream
