// SliceRequest: planes through a volume, or slabs of it, side by side in one picture, as `slice` makes it. A plane is a maximum intensity
// projection of what clipping leaves, so that it needs no more voxels than those. With layers it is a ray casting of a plane, whose rays
// have one opaque sample each.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "client/pictures/picture_writer.h"
#include "client/request/slice_planes.h"
#include "client/request/value_window.h"
#include "common/base/status.h"
#include "common/frame/frame_request.h"
#include "common/image/picture_image.h"

namespace slabstream {

struct SliceRequest {
  SliceRequest();

  std::span<const SlicePlane> planes = kSliceChoices.back().planes;
  std::optional<Vec3> at;             // a point of the world
  std::optional<std::int32_t> index;  // the slice's number, if there is one plane only. Neither: the volume's centre
  double thickness = 0;               // unit of the world; 0: a plane
  std::optional<ValueWindow> window;  // none: `frame.transfer`
  std::optional<double> level;        // data value, in place of the window's
  FrameRequest frame;                 // dataset, renderer, its parameters, size of each plane, transfer function, layers
  PictureFormat format;

  // What is shown from black to white; none: `frame.transfer` says it.
  std::optional<ValueWindow> shown_window() const {
    return window ? std::optional(ValueWindow{window->width, level.value_or(window->level)}) : std::nullopt;
  }
  ImageSize size() const { return {frame.size.width * int(planes.size()), frame.size.height}; }  // the size of the whole picture
};

// A frame for each plane, from left to right, all of them valid. InvalidArgument.
Result<std::vector<FrameRequest>> FramesOf(const SliceRequest& slice);

// Puts the pictures of those frames beside each other, from left to right.
PictureImage SideBySide(std::span<const PictureImage> images, ImageSize size);

}  // namespace slabstream
