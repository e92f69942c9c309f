#include "worker/renderers/zbuffer/cut_faces.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "worker/kernels/surface_face.h"

namespace slabstream {
namespace {

// Of the least spacing.
constexpr double kSlack = 0x1p-8;
constexpr double kMargin = 0.5;

constexpr std::uint32_t kCutAxis = 3;  // of FaceIndex: not the axis of a face

std::size_t PlaceIn(const KeyBand& band, std::int32_t x, std::int32_t y) {
  return std::size_t(y - band.bounds.y_begin) * band.stride + std::size_t(x - band.bounds.x_begin);
}

}  // namespace

CutFaces::CutFaces(SlabData& slab, const FrameSetup& setup, const Box& box, const BinSelection& opaque)
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
  const float inwards = float(keep_ ? slack_ : -slack_);
  for (std::int32_t y = pixels.y_begin; y < pixels.y_end; ++y) {
    const std::size_t first = PlaceIn(band, pixels.x_begin, y), end = first + std::size_t(pixels.width());
    std::fill(from + first, from + end, ClipRays::kNever);
    std::fill(to + first, to + end, -1.0F);
    const auto [begin_column, end_column] = rays_.ColumnsOf(y, pixels);
    if (begin_column >= end_column) continue;
    const std::size_t met = PlaceIn(band, begin_column, y), count = std::size_t(end_column - begin_column);
    rays_.Depths(begin_column, y, count, from + met, to + met);
    for (std::size_t n = met; n < met + count; ++n) {
      from[n] = from[n] > 0 ? from[n] + inwards : 0;
      to[n] -= inwards;
    }
  }
}

void CutFaces::Draw(const KeyBand& band, std::vector<CutPixel>& cuts) const {
  const PixelBounds pixels = Intersection(bounds(), band.bounds);
  if (pixels.empty() || least_depth_ >= ClipRays::kNever) return;
  for (std::int32_t y = pixels.y_begin; y < pixels.y_end; ++y) {
    const ClipRays::Columns columns = rays_.ColumnsOf(y, pixels);
    if (columns.begin < columns.end && !AllNearer(band, {columns.begin, y, columns.end, y + 1}, least_depth_)) {
      DrawRow(band, y, columns, cuts);
    }
  }
}

void CutFaces::DrawRow(const KeyBand& band, std::int32_t row, ClipRays::Columns columns, std::vector<CutPixel>& cuts) const {
  constexpr std::int32_t kPixels = 256;  // at a time
  const double y = row + 0.5;
  std::array<double, 3> origin{}, direction{};
  for (std::size_t i = 0; i < 3; ++i) {
    origin[i] = origin_[i].At(0, y) + 1.5;  // conversion to an integer rounds towards 0
    direction[i] = direction_[i].At(0, y);
  }
  VisitScalarType(voxels_.type, [&]<class T>(const T*) {
    const T* const samples = voxels_.samples<T>();
    for (std::int32_t begin = columns.begin; begin < columns.end; begin += kPixels) {
      std::array<float, kPixels> enter, leave;
      const std::int32_t end = std::min(begin + kPixels, columns.end);
      rays_.Depths(begin, row, std::size_t(end - begin), enter.data(), leave.data());
      const float* const depths = keep_ ? enter.data() : leave.data();
      std::uint64_t* const keys = band.keys + PlaceIn(band, begin, row);
      for (std::int32_t n = 0; n < end - begin; ++n) {
        const float depth = depths[n];
        if (!(depth > 0 && depth < ClipRays::kNever)) continue;
        const std::uint64_t key = std::uint64_t{std::bit_cast<std::uint32_t>(depth)} << 32 | (kFirstCut + cuts.size());
        if (key >= keys[n]) continue;
        // The voxel just behind the cut.
        const double x = begin + n + 0.5, behind = double(depth) + slack_;
        const auto along = [&](std::size_t i) {
          const double p = (origin[i] + x * origin_[i].by_x) + behind * (direction[i] + x * direction_[i].by_x);
          return std::int32_t(std::clamp(p, 0.0, double(kMaxVolumeSide) + 1)) - 1;
        };
        const Index3 voxel = {along(0), along(1), along(2)};
        if (!box_.Contains(voxel)) continue;
        const auto sample = double(samples[voxels_.Offset(voxel)]);
        if (!std::isfinite(sample)) continue;
        const auto bin = std::uint16_t(table_.BinOf(sample));
        if (opaque_.selected[bin] == 0) continue;
        const std::size_t side = keep_ ? rays_.SideEntered(begin + n, row) : rays_.SideLeft(begin + n, row);
        const std::uint32_t index = FaceIndex(std::uint32_t(voxel.x), std::uint32_t(voxel.y), std::uint32_t(voxel.z), kCutAxis,
                                              std::uint32_t(bricks_.x), std::uint32_t(bricks_.y));
        keys[n] = key;
        cuts.push_back({begin + n, row, depth, index, bin, std::uint16_t(side)});
      }
    }
  });
}

void CutFaces::TakeSeen(const KeyBand& band, std::vector<CutPixel>& cuts) {
  std::size_t seen = 0;
  for (std::size_t i = 0; i < cuts.size(); ++i) {
    std::uint64_t& key = band.keys[PlaceIn(band, cuts[i].x, cuts[i].y)];
    if (std::uint32_t(key) != kFirstCut + i) continue;
    cuts[seen++] = cuts[i];
    key = kEmptyKey;
  }
  cuts.resize(seen);
}

void CutFaces::Shade(const std::vector<CutPixel>& cuts, LocalImage& image) const {
  for (const CutPixel& cut : cuts) {
    const std::size_t pixel =
        std::size_t(cut.y - image.bounds.y_begin) * std::size_t(image.bounds.width()) + std::size_t(cut.x - image.bounds.x_begin);
    const Rgb& color = table_.color[cut.bin];
    const PhongFactors& light = light_[cut.side];
    const auto lit = [&](float channel) { return std::clamp(channel * light.diffuse + light.specular, 0.0F, 1.0F); };
    const std::array<float, 4> rgba = {lit(color.r), lit(color.g), lit(color.b), 1};
    std::ranges::copy(rgba, &image.rgba[4 * pixel]);
    image.depth[pixel] = cut.depth;
    image.voxel[pixel] = cut.voxel;
  }
}

}  // namespace slabstream
