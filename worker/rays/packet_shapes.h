// PacketShapes: the fragments of shapes on the rays of a packet, as kernels read them: in numbers of samples, lane by lane.
#pragma once

#include <array>
#include <cstddef>

#include "worker/rays/box_fragments.h"
#include "worker/rays/ray_box.h"

namespace slabstream {

// `lanes`: of a packet, at most kMostShapeLanes.
inline constexpr std::size_t kMostShapeLanes = 16;

struct PacketShapes {
  using Lanes = std::array<float, kMostShapeLanes>;
  struct Layer {
    alignas(64) Lanes k;                     // of the n-th fragment of each ray; kRayEnd: there is none
    alignas(64) Lanes alpha;                 // 0: there is none, or another box has it
    alignas(64) std::array<Lanes, 3> color;  // straight
  };
  std::array<Layer, kMostShapeFragments> layers;
  std::size_t count = 0;
  alignas(64) Lanes ends;  // where an opaque fragment ends the ray; kRayEnd: nowhere
  bool any_owned = false;  // some fragment belongs to the box

  // Of the packet of `width` x `lanes / width` pixels from (x, y) on, as far as they lie in `tile`. `jitter`: by lane, in samples. False:
  // there is nothing on its rays.
  bool Load(const ShapeTile& shapes, const FragmentOrder& order, const ViewRays& rays, const RayBox& box, const PixelBounds& tile,
            std::int32_t x, std::int32_t y, std::int32_t width, std::size_t lanes, const float* jitter) {
    bool any = false;
    count = 0;
    any_owned = false;
    for (std::size_t lane = 0; lane < lanes; ++lane) {
      const std::int32_t px = x + std::int32_t(lane) % width, py = y + std::int32_t(lane) / width;
      ends[lane] = kRayEnd;
      std::size_t n = 0;
      if (px < tile.x_end && py < tile.y_end) {
        for (const ShapeFragment& fragment : shapes.At(px, py)) {
          any = true;
          const auto k = float(SampleAtDepth(rays, px, py, fragment.depth) - double(jitter[lane]));
          if (fragment.rgba[3] == 1) {
            ends[lane] = k;
            break;
          }
          if (n == count) Clear(layers[count++]);
          Layer& layer = layers[n++];
          layer.k[lane] = k;
          if (!Owns(box.low, box.high, order.Of(px, py, fragment.depth))) continue;
          any_owned = true;
          layer.alpha[lane] = fragment.rgba[3];
          for (std::size_t i = 0; i < 3; ++i) layer.color[i][lane] = fragment.rgba[i] / fragment.rgba[3];
        }
      }
    }
    return any;
  }

 private:
  static void Clear(Layer& layer) {
    layer.k.fill(kRayEnd);
    layer.alpha.fill(0);
    for (Lanes& channel : layer.color) channel.fill(0);
  }
};

}  // namespace slabstream
