#include "worker/renderers/zbuffer/cut_faces.h"

#include <hwy/cache_control.h>

#include <algorithm>
#include <bit>
#include <cmath>

#include "worker/kernels/surface_face.h"

namespace slabstream {
namespace {

// Of the least spacing.
constexpr double kSlack = 0x1p-8;
constexpr double kMargin = 0.5;

constexpr std::int32_t kPixels = 256;  // of a row, at a time
constexpr std::uint32_t kCutAxis = 3;  // of FaceIndex: not the axis of a face

std::size_t PlaceIn(const KeyBand& band, std::int32_t x, std::int32_t y) {
  return std::size_t(y - band.bounds.y_begin) * band.stride + std::size_t(x - band.bounds.x_begin);
}

}  // namespace

CutFaces::CutFaces(BoxData& data, const FrameSetup& setup, const Box& box, const BinSelection& opaque, const BoxLabels* labels)
    : region_(setup.clip),
      rays_(setup.clip, setup.camera, box),
      voxels_(data.voxels()),
      box_(box),
      keep_(setup.clip.mode == ClipMode::kKeep),
      slack_(kSlack * Least(setup.description.geometry.spacing)),
      margin_(kMargin * Least(setup.description.geometry.spacing)),
      least_depth_(keep_ ? rays_.least_enter() : rays_.least_leave()),
      table_(data.Classification(setup)),
      opaque_(opaque),
      labels_(labels),
      frame_light_(data.light()),
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
    const Vec3 normal = Normalized(side.normal / setup.description.geometry.spacing);
    light_.push_back(lit ? phong.AtNormal(normal) : PhongFactors{});
    if (frame_light_ == nullptr) continue;
    for (const Vec3& light : phong.lights()) {
      Shading alone = setup.shading;
      alone.lights = {light};
      const PhongFactors factors = Phong(alone, camera.view_direction).AtNormal(normal);
      const float each = 1 / float(phong.lights().size());
      of_each_light_.push_back(lit ? PhongFactors{factors.diffuse - setup.shading.On().ambient, factors.specular} : PhongFactors{each, 0});
    }
  }
  if (lit) ambient_ = setup.shading.On().ambient;
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

void CutFaces::Draw(const KeyBand& band, std::vector<CutPixel>& cuts) const {
  const PixelBounds pixels = Intersection(bounds(), band.bounds);
  if (pixels.empty() || least_depth_ >= kNeverMet) return;
  for (std::int32_t y = pixels.y_begin; y < pixels.y_end; ++y) {
    const ClipRays::Columns columns = rays_.ColumnsOf(y, pixels);
    if (columns.begin < columns.end && !AllHidden(band, {columns.begin, y, columns.end, y + 1}, least_depth_)) {
      DrawRow(band, y, columns, cuts);
    }
  }
}

void CutFaces::DrawRow(const KeyBand& band, std::int32_t y, ClipRays::Columns columns, std::vector<CutPixel>& cuts) const {
  const RegionRow region = rays_.Row(y);
  RayRow rays;
  for (std::size_t i = 0; i < 3; ++i) {
    rays.origin[i] = origin_[i].InRow(y);
    rays.direction[i] = direction_[i].InRow(y);
  }
  std::array<float, kPixels + kRowPadding> enter, leave;
  std::array<std::array<std::int32_t, kPixels + kRowPadding>, 3> voxels;
  // Voxels along a cut lie far apart in memory: all of them are fetched before the first one is read.
  std::array<std::int32_t, kPixels> candidates;
  VisitScalarType(voxels_.type, [&]<class T>(const T*) {
    const T* const samples = voxels_.samples<T>();
    for (std::int32_t begin = columns.begin; begin < columns.end; begin += kPixels) {
      const std::int32_t pixels = std::min(kPixels, columns.end - begin);
      RegionDepths(region, begin, std::size_t(pixels), enter.data(), leave.data());
      const float* const depths = keep_ ? enter.data() : leave.data();
      VoxelsAt(rays, begin, std::size_t(pixels), depths, slack_, voxels[0].data(), voxels[1].data(), voxels[2].data());
      std::uint64_t* const keys = band.keys + PlaceIn(band, begin, y);
      const auto voxel_at = [&](std::size_t n) { return Index3{voxels[0][n], voxels[1][n], voxels[2][n]}; };
      std::size_t count = 0;
      for (std::int32_t n = 0; n < pixels; ++n) {
        const float depth = depths[std::size_t(n)];
        const Index3 voxel = voxel_at(std::size_t(n));
        if (!(depth > 0 && depth < kNeverMet) || std::bit_cast<std::uint32_t>(depth) > keys[n] >> 32 || !box_.Contains(voxel)) continue;
        hwy::Prefetch(samples + voxels_.Offset(voxel));
        candidates[count++] = n;
      }
      for (std::size_t i = 0; i < count; ++i) {
        const std::int32_t n = candidates[i], x = begin + n;
        const Index3 voxel = voxel_at(std::size_t(n));
        const auto sample = double(samples[voxels_.Offset(voxel)]);
        const std::uint32_t label = labels_ != nullptr ? labels_->NumberOf(voxel) : 0;
        const LabelUse use = labels_ != nullptr ? labels_->uses[label] : LabelUse::kAsVolume;
        if (use == LabelUse::kClear) continue;
        std::uint16_t bin = 0;
        if (use == LabelUse::kAsVolume) {
          if (!std::isfinite(sample)) continue;
          bin = std::uint16_t(table_.BinOf(sample));
          if (opaque_.selected[bin] == 0) continue;
        }
        const float depth = depths[std::size_t(n)];
        const std::uint32_t index = FaceIndex(std::uint32_t(voxel.x), std::uint32_t(voxel.y), std::uint32_t(voxel.z), kCutAxis,
                                              std::uint32_t(bricks_.x), std::uint32_t(bricks_.y));
        const std::size_t side = keep_ ? rays_.SideEntered(x, y) : rays_.SideLeft(x, y);
        keys[n] = std::uint64_t{std::bit_cast<std::uint32_t>(depth)} << 32 | (kFirstCut + cuts.size());
        cuts.push_back({x, y, depth, index, label, bin, std::uint16_t(side)});
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

PhongFactors CutFaces::LightOn(const CutPixel& cut) const {
  if (frame_light_ == nullptr) return light_[cut.side];
  Vec3 at;
  for (const Axis axis : kAxes) {
    const auto i = std::size_t(Number(axis));
    at[axis] = origin_[i].At(cut.x + 0.5, cut.y + 0.5) + double(cut.depth) * direction_[i].At(cut.x + 0.5, cut.y + 0.5);
  }
  const FrameLight::Shares shares = frame_light_->At(at);
  const std::size_t lights = of_each_light_.size() / light_.size();
  PhongFactors sum = {ambient_, 0};
  for (std::size_t i = 0; i < lights; ++i) {
    const PhongFactors& factors = of_each_light_[cut.side * lights + i];
    const float reached = shares.reached[std::min(i, std::size_t(frame_light_->lights) - 1)];
    sum.diffuse += reached * factors.diffuse;
    sum.specular += reached * factors.specular;
  }
  return {shares.open * sum.diffuse, sum.specular};
}

void CutFaces::Shade(const std::vector<CutPixel>& cuts, const FaceShading& shading, LocalImage& image) const {
  for (const CutPixel& cut : cuts) {
    const std::size_t pixel =
        std::size_t(cut.y - image.bounds.y_begin) * std::size_t(image.bounds.width()) + std::size_t(cut.x - image.bounds.x_begin);
    const float* const of_bin = shading.colors + 4 * std::size_t{cut.bin};
    const float* const of_label = shading.labels != nullptr ? shading.label_colors + 4 * std::size_t{cut.label} : nullptr;
    const PhongFactors light = LightOn(cut);
    for (std::size_t c = 0; c < 3; ++c) {
      const float color = of_label != nullptr ? of_bin[c] * (1 - of_label[3]) + of_label[c] : of_bin[c];
      image.rgba[4 * pixel + c] = std::clamp(color * light.diffuse + light.specular, 0.0F, 1.0F);
    }
    image.rgba[4 * pixel + 3] = 1;
    image.depth[pixel] = cut.depth;
    image.voxel[pixel] = cut.voxel;
  }
}

}  // namespace slabstream
