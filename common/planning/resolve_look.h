// How a request shows a dataset, whatever its view.
#pragma once

#include <string>

#include "common/base/status.h"
#include "common/frame/frame_request.h"
#include "common/frame/frame_setup.h"
#include "common/volume/summary.h"

namespace slabstream {

// The function that a request names or holds, for this volume. NotFound: no such preset.
Result<TransferFunction> ResolveTransfer(const TransferChoice& choice, const VolumeSummary& summary);

// InvalidArgument: the renderer draws cells, and the dataset has none.
Status CheckHasWhatIsDrawn(const RendererKind& renderer, const std::string& dataset, const VolumeSummary& summary);

struct VolumeLook {
  TransferFunction transfer;
  ClipRegion clip;
  LayerLooks layers;
};
// InvalidArgument: as CheckHasWhatIsDrawn; the volume has no slice with the slab's index, or no such layer, or there is no such label;
// NotFound: no such preset.
Result<VolumeLook> ResolveLook(const FrameRequest& request, const VolumeSummary& summary);

}  // namespace slabstream
