// --labels and --overlay: the files of a volume's layers.
#pragma once

#include "common/cli/command.h"
#include "common/frame/frame_request.h"
#include "data/layers/layer_files.h"

namespace slabstream {

// `shown`: the request that shows a layer whose file is given; may be null.
void AddLayerFiles(const Command& app, LayerFiles& files, FrameRequest* shown = nullptr);

}  // namespace slabstream
