#include "common/renderers/renderer_kind.h"

#include <cmath>

#include "common/image/local_image.h"
#include "common/image/resolve.h"
#include "common/kernels/resample.h"
#include "common/parallel/parallel.h"
#include "common/view/supersampled_voxel.h"

namespace slabstream {
namespace {

// Pixels of the frame for a step of the least spacing, at the middle of the volume.
double PixelsPerVoxel(const FrameSetup& setup) {
  const VolumeGeometry& geometry = setup.description.geometry;
  const Index3& size = geometry.size;
  const Vec3 middle = {(size.x - 1) / 2.0, (size.y - 1) / 2.0, (size.z - 1) / 2.0};
  const double least = Least(geometry.spacing);
  if (!setup.sheets.empty()) {
    const auto [c, u, v] = AxesOf(setup.camera.traversal_axis);
    const SlicePlacement slice = PlaceSlice(setup.sheets, middle[c]);
    return least * std::sqrt(slice.scale_u * slice.scale_v / (geometry.spacing[u] * geometry.spacing[v]));
  }
  const Camera::ImagePoint at = setup.camera.Project(middle);
  const Camera::ImagePoint beside = setup.camera.Project(middle + least * setup.camera.right / geometry.spacing);
  return std::hypot(beside.x - at.x, beside.y - at.y);
}

LocalImage ResamplePicture(const LocalImage& frame, const FrameSetup& setup) {
  const PixelBounds reached = ReachedPixels(frame.bounds, setup.sheets.from_picture, setup.camera.width, setup.camera.height);
  LocalImage picture = MakeUnwrittenImage(frame.format, reached);
  constexpr std::int32_t kRows = 16;
  ParallelForRanges(reached.y_begin, reached.y_end, kRows, [&](std::int32_t begin, std::int32_t end) {
    const std::size_t row_floats = 4 * std::size_t(reached.width());
    std::fill_n(picture.rgba.data() + std::size_t(begin - reached.y_begin) * row_floats, std::size_t(end - begin) * row_floats, 0.0F);
    ResampleRows(frame, setup.sheets.from_picture, begin, end, picture);
  });
  return picture;
}

}  // namespace

CostView CostViewOf(const FrameSetup& setup) { return {.along = setup.camera.traversal_axis, .pixels_per_voxel = PixelsPerVoxel(setup)}; }

std::vector<std::string_view> RendererKind::AbilityNames() const {
  std::vector<std::string_view> names;
  for (const Ability ability : facts_.abilities) names.push_back(NameOf(ability));
  return names;
}

Status RendererKind::SetView(const ViewParameters& view, ImageSize size, FrameSetup& setup) const {
  const VolumeGeometry& farthest = GeometryOf(setup, std::uint8_t(setup.coarser.size()));
  setup.camera = MakeCamera(view, size, setup.description.geometry, SupersampledVoxel(farthest));
  return Status::Ok();
}

ClassificationTable RendererKind::Table(const TransferFunction& transfer, const VolumeDescription& description, ValueRange range) const {
  return Classify(transfer, description, range);
}

ClassificationTable RendererKind::DrawnTable(const TransferFunction& transfer, const VolumeSummary& summary) const {
  return Table(transfer, summary.description, summary.range);
}

LocalImage RendererKind::Finish(const LocalImage& frame, const FrameSetup& setup) const {
  if (setup.sheets.empty()) return Resolve(frame, setup.camera.supersample);
  return frame.bounds.empty() ? frame : ResamplePicture(frame, setup);
}

bool RendererKind::FinishCopies(const FrameSetup& setup) const { return setup.sheets.empty() && setup.camera.supersample == 1; }

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
