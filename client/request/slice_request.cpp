#include "client/request/slice_request.h"

#include <fmt/format.h>

#include <algorithm>
#include <string>

#include "common/base/check.h"
#include "common/renderers/registry.h"
#include "common/view/named_view.h"
#include "common/volume/field_info.h"
#include "common/wire/validate_request.h"

namespace slabstream {
namespace {

FrameRequest FrameOf(const SliceRequest& slice, const SlicePlane& plane) {
  FrameRequest frame = slice.frame;
  const NamedView& view = *std::ranges::find(kNamedViews, plane.view, &NamedView::name);
  frame.view.azimuth_degrees = view.azimuth_degrees;
  frame.view.elevation_degrees = view.elevation_degrees;
  frame.view.of_patient = plane.of_patient;
  frame.view.fit = true;
  frame.clipping.slab = ClipSlab{.normal = plane.normal, .through = slice.at, .index = slice.index, .thickness = slice.thickness};
  return frame;
}

std::string RendererThat(bool (*suits)(const RendererKind&)) {
  const auto found = std::ranges::find_if(Renderers(), [&](const RendererKind* kind) { return suits(*kind); });
  CHECK(found != Renderers().end());
  return std::string((*found)->name());
}

// Black to white; all values are opaque.
TransferFunction FunctionOf(const ValueWindow& window) {
  return {.colors = {{window.low(), {0, 0, 0}}, {window.high(), {1, 1, 1}}}, .opacities = {{window.level, 1}}};
}

}  // namespace

SliceRequest::SliceRequest() {
  frame.renderer = RendererThat([](const RendererKind& kind) {
    return std::ranges::find(kind.parameters(), "projection-mode", &RendererParameter::name) != kind.parameters().end();
  });
  frame.transfer.choice = "window";
  format.annotations.sides_only = true;
}

Result<std::vector<FrameRequest>> FramesOf(const SliceRequest& slice) {
  if (Status status = Validate(slice.size()); !status.ok()) return status;
  const bool overlay = std::ranges::count(slice.frame.fields, kOverlayField, &FieldChoice::field) > 0 ||
                       std::ranges::count(slice.frame.channels, kOverlayField) > 0;
  const bool layers = LabelsOf(slice.frame) != nullptr || overlay;
  if (layers && slice.thickness > 0) {
    return Status::InvalidArgument(fmt::format("--thickness {} is no plane, and layers are shown in planes only", slice.thickness));
  }
  if (slice.index && slice.planes.size() > 1) {
    return Status::InvalidArgument(
        fmt::format("--index {} is the number of a slice of one --plane, but there are {}", *slice.index, slice.planes.size()));
  }
  std::vector<FrameRequest> frames;
  for (const SlicePlane& plane : slice.planes) {
    FrameRequest& frame = frames.emplace_back(FrameOf(slice, plane));
    if (layers) {
      frame.renderer = RendererThat([](const RendererKind& kind) { return kind.Can(Ability::kLabels) && kind.Can(Ability::kFields); });
      frame.shading.model = ShadingModel::kNone;
    }
    if (const auto window = slice.shown_window()) frame.transfer.choice = FunctionOf(*window);
    if (Status status = Validate(frame); !status.ok()) return status;
  }
  return frames;
}

PictureImage SideBySide(std::span<const PictureImage> images, ImageSize size) {
  LocalImage all = MakeLocalImage(PixelFormat::kRgba, {0, 0, size.width * std::int32_t(images.size()), size.height});
  for (std::size_t i = 0; i < images.size(); ++i) {
    const PixelBounds& bounds = images[i].bounds();
    for (std::int32_t y = bounds.y_begin; y < bounds.y_end; ++y) {
      const auto to = std::size_t(y) * std::size_t(all.bounds.width()) + i * std::size_t(size.width) + std::size_t(bounds.x_begin);
      images[i].ReadColors(y, &all.rgba[4 * to]);
    }
  }
  return all;
}

}  // namespace slabstream
