// Renderer: the pixel half of a renderer. It turns the voxels of a box (with their halo) into the box's local image: the samples that the
// box owns, for a frame's camera, transfer function and shading. The planning half is RendererKind (common/renderers/renderer_kind.h).
//
// Each sample belongs to exactly one box, and a box computes the same samples however the volume is divided (docs/rendering.md): the
// borders of a box decide only which samples it owns.
#pragma once

#include <functional>
#include <memory>

#include "common/base/status.h"
#include "common/frame/frame_setup.h"
#include "common/image/local_image.h"
#include "common/image/occlusion_mask.h"
#include "common/stats/report.h"
#include "worker/renderers/box_data.h"
#include "worker/renderers/render_control.h"

namespace slabstream {

class Renderer {
 public:
  virtual ~Renderer() = default;

  // Local image of a box in setup.format. `data` holds the voxels and halo (PaddedBox) of the box. Its level is 0, unless the renderer
  // has Ability::kLevels. Pixels that `hidden` hides may be left
  // empty. Adds stage times, spans and counts to `report`; a stage's time is the sum over all threads, without pauses. If it is cancelled
  // it stops soon and returns Cancelled; it pauses between pieces (`control`). Called within the task arena of the worker's render threads:
  // parallel loops (common/parallel) use as many threads as the worker has.
  virtual Result<LocalImage> Render(BoxData& data, const LevelBox& at, const FrameSetup& setup, const OcclusionMask& hidden,
                                    const RenderControl& control, RankReport& report) = 0;
};

// The pixel half of `kind`, one of Renderers().
std::unique_ptr<Renderer> MakeRenderer(const RendererKind& kind);

using RendererFactory = std::function<std::unique_ptr<Renderer>(const RendererKind&)>;

}  // namespace slabstream
