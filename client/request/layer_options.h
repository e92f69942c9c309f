// Options about the layers of a volume: the files that they come from, and how they are shown.
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

#include "common/frame/frame_request.h"
#include "data/layers/layer_reader.h"

namespace slabstream {

// --labels and --overlay, which name files and show them, and --label-... and --overlay-... , each of which shows a layer, too. `files`
// null: no option names a file (picture_options.h). Opacities of labels are left out of `slice`.
void AddLayerOptions(CLI::App& app, FrameRequest& request, LayerFiles* files, bool opacities = true);
// --labels and --overlay alone.
void AddLayerFiles(CLI::App& app, LayerFiles& files);

// The options that say the same again, in their order.
std::vector<std::string> LayerArguments(const FrameRequest& request, const LayerFiles& files);

}  // namespace slabstream
