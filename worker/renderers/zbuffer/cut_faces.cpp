#include "worker/renderers/zbuffer/cut_faces.h"

#include <hwy/cache_control.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <span>
#include <type_traits>

#include "worker/kernels/surface_face.h"

namespace slabstream {
namespace {

// Of the least spacing.
constexpr double kSlack = 0x1p-8;
constexpr double kMargin = 0.5;

constexpr std::int32_t kPixels = 256;  // of a row, at a time
constexpr std::uint32_t kCutAxis = 3;  // of FaceIndex: not the axis of a face

// The low half of a key: of a cut, with bin << 16 | label; of none, as of an empty key.
constexpr std::uint32_t kCut = 0x80000000;  // surfaces have fewer faces
constexpr auto kNoCut = std::uint32_t(kEmptyKey);
static_assert(kMaxBins < 0x7FFF);  // so no cut looks like none

// Box::Contains without branches.
bool Holds(const Box& box, const Index3& voxel) {
  return (voxel.x >= box.begin.x) & (voxel.x < box.end.x) & (voxel.y >= box.begin.y) & (voxel.y < box.end.y) & (voxel.z >= box.begin.z) &
         (voxel.z < box.end.z);
}

std::size_t PlaceIn(const KeyBand& band, std::int32_t x, std::int32_t y) {
  return std::size_t(y - band.bounds.y_begin) * band.stride + std::size_t(x - band.bounds.x_begin);
}

}  // namespace

CutFaces::CutFaces(SlabData& slab, const FrameSetup& setup, const Box& box, const BinSelection& opaque, const ShownLabels* labels)
    : region_(setup.clip),
      rays_(setup.clip, setup.camera, box),
      voxels_(slab.voxels()),
      box_(box),
      keep_(setup.clip.mode == ClipMode::kKeep),
      slack_(kSlack * Least(setup.description.geometry.spacing)),
      margin_(kMargin * Least(setup.description.geometry.spacing)),
      least_depth_(keep_ ? rays_.least_enter() : rays_.least_leave()),
      table_(slab.Classification(setup)),
      opaque_(opaque),
      labels_(labels),
      bricks_(CubesOver(setup.description.geometry.size, kFaceBrick)) {
  const Camera& camera = setup.camera;
  const Camera::Ray first = camera.RayAt(0, 0), right = camera.RayAt(camera.width, 0), down = camera.RayAt(0, camera.height);
  for (const Axis axis : kAxes) {
    const auto i = std::size_t(Number(axis));
    origin_[i] = MakeLinear(camera, first.origin[axis], right.origin[axis], down.origin[axis]);
    direction_[i] = MakeLinear(camera, first.direction[axis], right.direction[axis], down.direction[axis]);
  }
  const Phong phong(setup.shading, camera.view_direction);
  const bool lit = setup.shading.model == ShadingModel::kPhong;
  for (const HalfSpace& side : setup.clip.sides) {
    light_.push_back(lit ? phong.AtNormal(Normalized(side.normal / setup.description.geometry.spacing)) : PhongFactors{});
  }
}

bool CutFaces::IsWhole(const Box& part) const { return region_.KeepsAll(part, margin_); }

void CutFaces::Limits(const PixelBounds& pixels, const KeyBand& band, float* from, float* to) const {
  const auto inwards = float(keep_ ? slack_ : -slack_);
  std::array<float, kPixels + kRowPadding> enter, leave;
  for (std::int32_t y = pixels.y_begin; y < pixels.y_end; ++y) {
    const std::size_t first = PlaceIn(band, pixels.x_begin, y), end = first + std::size_t(pixels.width());
    std::fill(from + first, from + end, kNeverMet);
    std::fill(to + first, to + end, -1.0F);
    const RegionRow row = rays_.Row(y);
    const ClipRays::Columns columns = rays_.ColumnsOf(y, pixels);
    for (std::int32_t column = columns.begin; column < columns.end; column += kPixels) {
      const auto count = std::size_t(std::min(kPixels, columns.end - column));
      RegionDepths(row, column, count, enter.data(), leave.data());
      const std::size_t at = PlaceIn(band, column, y);
      for (std::size_t n = 0; n < count; ++n) {
        from[at + n] = enter[n] > 0 ? enter[n] + inwards : 0;
        to[at + n] = leave[n] - inwards;
      }
    }
  }
}

RayRow CutFaces::RaysOf(std::int32_t y) const {
  RayRow rays;
  for (std::size_t i = 0; i < 3; ++i) {
    rays.origin[i] = origin_[i].InRow(y);
    rays.direction[i] = direction_[i].InRow(y);
  }
  return rays;
}

void CutFaces::Draw(const KeyBand& band) const {
  const PixelBounds pixels = Intersection(bounds(), band.bounds);
  if (pixels.empty() || least_depth_ >= kNeverMet) return;
  for (std::int32_t y = pixels.y_begin; y < pixels.y_end; ++y) {
    const ClipRays::Columns columns = rays_.ColumnsOf(y, pixels);
    if (columns.begin < columns.end && !AllHidden(band, {columns.begin, y, columns.end, y + 1}, least_depth_)) DrawRow(band, y, columns);
  }
}

template <class T, class VoxelAt>
HWY_INLINE std::uint32_t CutFaces::LookOf(T sample, VoxelAt&& voxel_at) const {
  std::uint32_t label = 0;
  if (labels_ != nullptr) {
    label = labels_->NumberOf(voxel_at());
    const LabelUse use = labels_->uses[label];
    if (use == LabelUse::kOpaque) return kCut | label;
    if (use == LabelUse::kClear) return kNoCut;
  }
  if constexpr (!std::is_integral_v<T>) {
    if (!std::isfinite(sample)) return kNoCut;
  }
  const auto bin = std::uint32_t(table_.BinOf(double(sample)));
  return opaque_.selected[bin] != 0 ? kCut | bin << 16 | label : kNoCut;
}

void CutFaces::DrawRow(const KeyBand& band, std::int32_t y, ClipRays::Columns columns) const {
  const RegionRow region = rays_.Row(y);
  const RayRow rays = RaysOf(y);
  std::array<float, kPixels + kRowPadding> enter, leave;
  std::array<std::array<std::int32_t, kPixels + kRowPadding>, 3> voxels;
  // Pixels that may see a cut, and the places of their voxels' samples. Neither loop branches: where cuts are seen is hard to foretell.
  std::array<std::int32_t, kPixels> candidates;
  std::array<std::ptrdiff_t, kPixels> offsets;
  VisitScalarType(voxels_.type, [&]<class T>(const T*) {
    const T* const samples = voxels_.samples<T>();
    for (std::int32_t begin = columns.begin; begin < columns.end; begin += kPixels) {
      const std::int32_t pixels = std::min(kPixels, columns.end - begin);
      RegionDepths(region, begin, std::size_t(pixels), enter.data(), leave.data());
      const float* const depths = keep_ ? enter.data() : leave.data();
      VoxelsAt(rays, begin, std::size_t(pixels), depths, slack_, voxels[0].data(), voxels[1].data(), voxels[2].data());
      std::uint64_t* const keys = band.keys + PlaceIn(band, begin, y);
      std::size_t count = 0;
      for (std::int32_t n = 0; n < pixels; ++n) {
        const float depth = depths[n];
        const Index3 voxel = {voxels[0][std::size_t(n)], voxels[1][std::size_t(n)], voxels[2][std::size_t(n)]};
        candidates[count] = n;
        offsets[count] = voxels_.Offset(voxel);
        count +=
            std::size_t((depth > 0) & (depth < kNeverMet) & (std::bit_cast<std::uint32_t>(depth) <= keys[n] >> 32) & Holds(box_, voxel));
      }
      // Voxels along a cut lie far apart in memory: all are fetched before the first one is read.
      for (std::size_t i = 0; i < count; ++i) hwy::Prefetch(samples + offsets[i]);
      for (std::size_t i = 0; i < count; ++i) {
        const std::int32_t n = candidates[i];
        const std::uint32_t look = LookOf(samples[offsets[i]], [&] {
          return Index3{voxels[0][std::size_t(n)], voxels[1][std::size_t(n)], voxels[2][std::size_t(n)]};
        });
        const std::uint64_t key = std::uint64_t{std::bit_cast<std::uint32_t>(depths[n])} << 32 | look;
        keys[n] = look != kNoCut ? key : keys[n];
      }
    }
  });
}

void CutFaces::TakeSeen(const KeyBand& band, std::int32_t y, SeenCuts& seen) const {
  const PixelBounds pixels = Intersection(bounds(), band.bounds);
  const ClipRays::Columns columns = y >= pixels.y_begin && y < pixels.y_end ? rays_.ColumnsOf(y, pixels) : ClipRays::Columns{0, 0};
  seen.begin = columns.begin;
  seen.end = std::max(columns.begin, columns.end);
  const auto width = std::size_t(seen.end - seen.begin);
  if (width == 0) return;
  if (seen.depth.size() < width + kRowPadding) {
    seen.depth.resize(width + kRowPadding);
    seen.looks.resize(width);
  }
  std::uint64_t* const keys = band.keys + PlaceIn(band, seen.begin, y);
  for (std::size_t n = 0; n < width; ++n) {
    const std::uint64_t key = keys[n];
    const bool is_cut = (key & kCut) != 0 && std::uint32_t(key) != kNoCut;
    seen.depth[n] = is_cut ? std::bit_cast<float>(std::uint32_t(key >> 32)) : 0;
    seen.looks[n] = std::uint32_t(key) & ~kCut;
    keys[n] = is_cut ? kEmptyKey : key;
  }
}

void CutFaces::Shade(const SeenCuts& seen, std::int32_t y, const FaceShading& shading, LocalImage& image) const {
  const RayRow rays = RaysOf(y);
  std::array<std::array<std::int32_t, kPixels + kRowPadding>, 3> voxels;
  for (std::int32_t begin = seen.begin; begin < seen.end; begin += kPixels) {
    const auto count = std::size_t(std::min(kPixels, seen.end - begin));
    const float* const depths = seen.depth.data() + (begin - seen.begin);
    const std::uint32_t* const looks = seen.looks.data() + (begin - seen.begin);
    if (std::none_of(depths, depths + count, [](float depth) { return depth > 0; })) continue;
    VoxelsAt(rays, begin, count, depths, slack_, voxels[0].data(), voxels[1].data(), voxels[2].data());
    const std::size_t first =
        std::size_t(y - image.bounds.y_begin) * std::size_t(image.bounds.width()) + std::size_t(begin - image.bounds.x_begin);
    for (std::size_t n = 0; n < count; ++n) {
      if (depths[n] == 0) continue;
      const std::int32_t x = begin + std::int32_t(n);
      const PhongFactors& light = light_[keep_ ? rays_.SideEntered(x, y) : rays_.SideLeft(x, y)];
      const float* const of_bin = shading.colors + 4 * std::size_t{looks[n] >> 16};
      const float* const of_label = shading.labels != nullptr ? shading.label_colors + 4 * std::size_t{looks[n] & 0xFFFF} : nullptr;
      const std::size_t pixel = first + n;
      for (std::size_t c = 0; c < 3; ++c) {
        const float color = of_label != nullptr ? of_bin[c] * (1 - of_label[3]) + of_label[c] : of_bin[c];
        image.rgba[4 * pixel + c] = std::min(std::max(color * light.diffuse + light.specular, 0.0F), 1.0F);
      }
      image.rgba[4 * pixel + 3] = 1;
      image.depth[pixel] = depths[n];
      image.voxel[pixel] = FaceIndex(std::uint32_t(voxels[0][n]), std::uint32_t(voxels[1][n]), std::uint32_t(voxels[2][n]), kCutAxis,
                                     std::uint32_t(bricks_.x), std::uint32_t(bricks_.y));
    }
  }
}

}  // namespace slabstream
