#include "common/renderers/renderer_kind.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <utility>

#include "common/image/local_image.h"
#include "common/image/resolve.h"
#include "common/kernels/resample.h"

namespace slabstream {
namespace {

LocalImage ResamplePicture(const LocalImage& frame, const FrameSetup& setup) {
  LocalImage picture = MakeUnwrittenImage(frame.format, {0, 0, setup.camera.width, setup.camera.height});
  constexpr std::int32_t kRows = 16;
  tbb::parallel_for(tbb::blocked_range<std::int32_t>(0, setup.camera.height, kRows), [&](const auto& rows) {
    const std::size_t row_floats = 4 * std::size_t(setup.camera.width);
    std::fill_n(picture.rgba.data() + std::size_t(rows.begin()) * row_floats, rows.size() * row_floats, 0.0F);
    ResampleRows(frame, setup.sheets.from_picture, rows.begin(), rows.end(), picture);
  });
  return picture;
}

}  // namespace

ClassificationTable RendererKind::DrawnTable(const TransferFunction& transfer, const VolumeSummary& summary) const {
  return Classify(transfer, summary.description, summary.range);
}

LocalImage RendererKind::Finish(const LocalImage& frame, const FrameSetup& setup) const {
  if (setup.sheets.empty()) return Resolve(frame, setup.camera.supersample);
  return frame.bounds.empty() ? frame : ResamplePicture(frame, setup);
}

bool RendererKind::FrameIsPicture(const FrameSetup& setup) const { return setup.sheets.empty() && setup.camera.supersample == 1; }

void SetRenderer(const RendererKind& kind, FrameSetup& setup) {
  setup.renderer = &kind;
  setup.halo = kind.reach();
  std::vector<double> values;
  for (const RendererParameter& parameter : kind.parameters()) values.push_back(parameter.standard);
  SetParameters(std::move(values), setup);
}

void SetParameters(std::vector<double> values, FrameSetup& setup) {
  setup.parameters = std::move(values);
  setup.format = setup.renderer->FormatOf(setup.parameters);
}

}  // namespace slabstream
