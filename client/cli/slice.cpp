// `slice`: a plane through a volume, or a slab of it. It is a maximum intensity projection of what clipping leaves, so that it needs no
// more voxels than those. With layers it is a ray casting of a plane, whose rays have one opaque sample each.
#include <fmt/format.h>

#include <algorithm>
#include <iostream>

#include "client/cli/commands.h"
#include "client/cli/session.h"
#include "client/image_io/image_writer.h"
#include "common/base/files.h"
#include "common/planning/validate_request.h"
#include "common/view/named_view.h"

namespace slabstream {
namespace {

FrameRequest RequestOf(const SliceOptions& options, const SlicePlane& plane) {
  FrameRequest request = options.request;
  const NamedView& view = *std::ranges::find(kNamedViews, plane.view, &NamedView::name);
  request.view.azimuth_degrees = view.azimuth_degrees;
  request.view.elevation_degrees = view.elevation_degrees;
  request.view.of_patient = plane.of_patient;
  request.view.fit = true;
  request.clipping.slab = ClipSlab{.normal = plane.normal, .through = options.at, .index = options.index, .thickness = options.thickness};
  return request;
}

// Values from level - window / 2 to level + window / 2 are black to white; all are opaque.
TransferFunction Window(double window, double level) {
  return {.colors = {{level - window / 2, {0, 0, 0}}, {level + window / 2, {1, 1, 1}}}, .opacities = {{level, 1}}};
}

// Puts pictures of one size beside each other, from left to right.
LocalImage SideBySide(const std::vector<Picture>& pictures, ImageSize size) {
  LocalImage all = MakeLocalImage(PixelFormat::kRgba, {0, 0, size.width * std::int32_t(pictures.size()), size.height});
  for (std::size_t i = 0; i < pictures.size(); ++i) {
    const LocalImage& image = pictures[i].image;
    const auto width = std::size_t(image.bounds.width());
    for (std::int32_t y = image.bounds.y_begin; y < image.bounds.y_end; ++y) {
      const auto to = std::size_t(y) * std::size_t(all.bounds.width()) + i * std::size_t(size.width) + std::size_t(image.bounds.x_begin);
      std::copy_n(&image.rgba[4 * std::size_t(y - image.bounds.y_begin) * width], 4 * width, &all.rgba[4 * to]);
    }
  }
  return all;
}

}  // namespace

Status RunSlice(const SliceOptions& options) {
  if (Status status = CheckPicturePath(options.output); !status.ok()) return status;
  if (Status status = CheckCanWrite("--output", options.output); !status.ok()) return status;
  const ImageSize size = options.request.size;
  const ImageSize whole = {size.width * int(options.planes.size()), size.height};
  if (Status status = Validate(whole); !status.ok()) return status;
  const bool layers = options.request.labels || options.request.overlay;
  if (layers && options.thickness > 0) {
    return Status::InvalidArgument(fmt::format("--thickness {} is no plane, and layers are shown in planes only", options.thickness));
  }
  if (options.index && options.planes.size() > 1) {
    return Status::InvalidArgument(
        fmt::format("--index {} is the number of a slice of one --plane, but there are {}", *options.index, options.planes.size()));
  }
  Result<Session> session = Session::Open(options.connection, options.source, options.layers);
  if (!session.ok()) return session.status();
  std::vector<FrameRequest> requests;
  for (const SlicePlane& plane : options.planes) {
    FrameRequest& request = requests.emplace_back(RequestOf(options, plane));
    request.dataset = session->dataset();
    if (layers) {
      request.renderer = "raycast";
      request.shading.model = ShadingModel::kNone;
    }
    if (options.window) request.transfer.choice = Window(*options.window, options.level.value_or(*options.window / 2));
    if (Status status = Validate(request); !status.ok()) return status;
  }
  std::vector<Picture> pictures;
  for (const FrameRequest& request : requests) {
    Result<Picture> picture = session->client().Render(request);
    if (!picture.ok()) return picture.status();
    pictures.push_back(*std::move(picture));
  }
  if (Status status = WritePicture(SideBySide(pictures, size), whole, options.output, options.format); !status.ok()) return status;
  std::cout << fmt::format("wrote {} {}x{}\n", options.output, whole.width, whole.height);
  return Status::Ok();
}

}  // namespace slabstream
