// The pixel halves of all renderers. The list is the same as that of the planning halves (common/renderers/CMakeLists.txt).
#include "common/base/check.h"
#include "common/renderers/renderer_kind.h"
#include "worker/renderers/renderer.h"

// Each renderer's folder defines MakePixelHalf() in a namespace with the renderer's name.
#define SLABSTREAM_RENDERER(folder)          \
  namespace slabstream::folder {             \
  std::unique_ptr<Renderer> MakePixelHalf(); \
  }
#include "renderer_list.inc"
#undef SLABSTREAM_RENDERER

namespace slabstream {

std::unique_ptr<Renderer> MakeRenderer(const RendererKind& kind) {
#define SLABSTREAM_RENDERER(folder) \
  if (kind.name() == #folder) return folder::MakePixelHalf();
#include "renderer_list.inc"
#undef SLABSTREAM_RENDERER
  CHECK(false) << "no pixel half of renderer " << kind.name();
  return nullptr;
}

}  // namespace slabstream
