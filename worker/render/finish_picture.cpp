#include "worker/render/finish_picture.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>

#include "common/image/resolve.h"
#include "common/kernels/resample.h"

namespace slabstream {

bool FrameIsPicture(const FrameSetup& setup) { return setup.renderer != RendererKind::kSplat && setup.camera.supersample == 1; }

LocalImage FinishPicture(const LocalImage& frame, const FrameSetup& setup) {
  if (setup.renderer != RendererKind::kSplat) return Resolve(frame, setup.camera.supersample);
  if (frame.bounds.empty()) return frame;
  LocalImage picture = MakeUnwrittenImage(frame.format, {0, 0, setup.camera.width, setup.camera.height});
  constexpr std::int32_t kRows = 16;
  tbb::parallel_for(tbb::blocked_range<std::int32_t>(0, setup.camera.height, kRows), [&](const auto& rows) {
    const std::size_t row_floats = 4 * std::size_t(setup.camera.width);
    std::fill_n(picture.rgba.data() + std::size_t(rows.begin()) * row_floats, rows.size() * row_floats, 0.0F);
    ResampleRows(frame, setup.sheets.from_picture, rows.begin(), rows.end(), picture);
  });
  return picture;
}

}  // namespace slabstream
