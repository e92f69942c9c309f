#include "common/base/check.h"
#include "worker/render/pipeline.h"
#include "worker/render/splatting/splatting.h"
#include "worker/render/zbuffer/zbuffer.h"

namespace slabstream {

std::unique_ptr<Renderer> MakeRenderer(RendererKind kind) {
  switch (kind) {
    case RendererKind::kSplat: return std::make_unique<SplattingRenderer>();
    case RendererKind::kZBuffer: return std::make_unique<ZBufferRenderer>();
  }
  CHECK(false) << "renderer kind " << int(kind);
  return nullptr;
}

}  // namespace slabstream
