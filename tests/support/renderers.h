// Renderers in tests: short names for those that a test is about, and frames of a setup's renderer.
#pragma once

#include "common/base/check.h"
#include "common/image/local_image.h"
#include "common/renderers/registry.h"

namespace slabstream {

inline const RendererKind* Splatting() { return FindRenderer("splat"); }
inline const RendererKind* ZBuffer() { return FindRenderer("zbuffer"); }

inline void SetView(const ViewParameters& view, ImageSize size, FrameSetup& setup) {
  const Status status = setup.renderer->SetView(view, size, setup);
  CHECK(status.ok()) << status.message();
}

inline LocalImage FinishPicture(const LocalImage& frame, const FrameSetup& setup) { return setup.renderer->Finish(frame, setup); }

}  // namespace slabstream
