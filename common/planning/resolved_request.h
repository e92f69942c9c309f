// ResolvedRequest: a request in which all that it says about its dataset has been looked up: renderer, transfer function, clip region,
// labels, view and policy. A request is resolved once, when its dataset is there. Planning, counting and answering take the result, so they
// meet no unknown name.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/base/status.h"
#include "common/frame/frame_request.h"
#include "common/planning/classified_volume.h"
#include "common/planning/level_map.h"
#include "common/planning/resolved_policy.h"
#include "common/planning/shown_fields.h"
#include "common/volume/summary.h"

namespace slabstream {

struct ResolvedRequest {
  FrameRequest frame;                            // with its renderer's name, its whole view and a settled policy (SettledPolicy)
  ClassifiedVolume volume;                       // how it shows the dataset, whatever its view
  std::shared_ptr<const VolumeSummary> summary;  // of the dataset; never null
  ResolvedPolicy policy;
  // If the picture is drawn from several levels: which one each part, and those beside the summary's, finest first. Null: there are none.
  std::shared_ptr<const LevelMap> map = {};
  std::vector<CoarserVolume> coarser = {};
  // The level that the light volume is made from. None: the one that is drawn.
  std::optional<CoarserVolume> light = {};
  std::optional<Ball> framed = {};  // what the picture frames, if the request's view fits and anything shows
  ShownFields fields = {};
  double weight = 1;                   // of the volume: FieldLook::weight
  std::vector<ShapeLook> shapes = {};  // how it shows fields.shapes, and behind them its planes. Widths are in the world's unit
};

// Pure. The request must be valid (Validate). InvalidArgument: an unknown name in the policy (CheckNames), as RenderersFor and
// CheckHasWhatIsDrawn and ShownFields; the volume has no slice with the slab's index, or no such layer, or there is no such label;
// NotFound: no such preset.
Result<ResolvedRequest> ResolveRequest(FrameRequest request, DatasetId dataset, std::shared_ptr<const VolumeSummary> summary,
                                       ShownFields fields = {});

// InvalidArgument: the volume has no slice with the index of the clip slab, or of a plane. Of a volume with levels: the finest geometry,
// since others have other slices.
Status CheckSlices(const FrameRequest& request, const VolumeGeometry& geometry);

// The function that a request names or holds, for this volume. NotFound: no such preset.
Result<TransferFunction> ResolveTransfer(const TransferChoice& choice, const VolumeSummary& summary);

// InvalidArgument: the renderer draws cells, and the dataset has none.
Status CheckHasWhatIsDrawn(const RendererKind& renderer, const std::string& dataset, const VolumeSummary& summary);

}  // namespace slabstream
