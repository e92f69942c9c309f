#include "worker/light/frame_light.h"

#include <algorithm>
#include <array>
#include <iterator>
#include <mutex>
#include <optional>
#include <span>
#include <utility>

#include "common/base/lru_map.h"
#include "common/parallel/parallel.h"
#include "common/renderers/renderer_kind.h"
#include "common/view/phong.h"
#include "worker/light/occlusion.h"
#include "worker/light/pack_shares.h"
#include "worker/light/shape_extinction.h"
#include "worker/light/transmittance.h"

namespace slabstream {
namespace {

// What an Extinction is made from.
struct MatterKey {
  DatasetId dataset = 0;
  const RendererKind* renderer = nullptr;
  ClipRegion clip;
  std::vector<FieldLook> looks;
  std::vector<DatasetId> lights = {};
  std::vector<ShapeSetup> shapes = {};
  friend bool operator==(const MatterKey&, const MatterKey&) = default;
};

MatterKey KeyOf(const FrameSetup& setup) {
  MatterKey key = {setup.dataset, setup.renderer, setup.clip, LooksInLight(setup)};
  for (FieldLook& look : key.looks) {
    for (ColorPoint& point : look.transfer.colors) point.color = {};  // colours take no light
  }
  for (const CoarserLevel* const light : LightVolumesOf(setup)) key.lights.push_back(light->dataset);
  std::ranges::copy_if(setup.shapes, std::back_inserter(key.shapes), [](const ShapeSetup& shape) { return !shape.look.unlit; });
  for (ShapeSetup& shape : key.shapes) {
    shape.look.color = {};
    shape.look.map.clear();
    shape.look.low = shape.look.high = 0;
  }
  return key;
}

// The shares of one light, or of openness alone.
struct Lit {
  std::vector<Vec3> lights;
  float shadows = 0, occlusion = 0, radius = 0;
  int fast = 0;
  friend bool operator==(const Lit&, const Lit&) = default;
};

// Of the fields under their transfer functions, and of shapes. One thread at a time makes something of it.
class Matter {
 public:
  std::shared_ptr<const FrameLight> Of(const LightValues& values, const FrameSetup& setup,
                                       std::span<const std::shared_ptr<const VoxelBlock>> shapes) {
    const std::lock_guard lock(mutex_);
    if (!extinction_) {
      Extinction all = ExtinctionOf(values, setup);
      AddShapes(shapes, setup, all);
      extinction_ = std::move(all);
    }
    const Shading& shading = setup.shading;
    const Lit lit = {shading.shadows > 0 ? Phong(shading, setup.camera.view_direction).lights() : std::vector<Vec3>{Vec3{}},
                     shading.shadows, shading.ambient_occlusion, shading.occlusion_radius,
                     !setup.sheets.empty() && setup.camera.traversal_axis == Axis::kX ? 1 : 0};
    if (const auto* made = made_.Find(lit)) return *made;
    auto light = std::make_shared<FrameLight>();
    light->size = extinction_->size;
    light->lights = int(lit.lights.size());
    const GridMap map = MapBetween(setup.description.geometry, setup.light->description.geometry);
    for (int axis = 0; axis < 3; ++axis) {
      light->scale[std::size_t(axis)] = float(map.scale[axis]);
      light->offset[std::size_t(axis)] = float(map.offset[axis]);
    }
    const Index3 whole = light->size + Uniform(1);
    light->fast = lit.fast;
    light->stride = lit.fast == 0 ? std::array{2, 2 * whole.x, 2 * whole.x * whole.y} : std::array{2 * whole.y * whole.z, 2, 2 * whole.y};
    light->light = 2 * whole.x * whole.y * whole.z;
    light->shares.resize(std::size_t(light->light) * lit.lights.size() + FrameLight::kSharesPadding);
    FindOpen(shading);
    Bytes255 reached(shading.shadows > 0 ? extinction_->each.size() : 0);
    for (std::size_t i = 0; i < lit.lights.size(); ++i) {
      int fast = light->fast;  // of `reached`
      if (shading.shadows > 0) {
        const Vec3& to_light = lit.lights[i];
        fast = SweepsAlongX(*extinction_, to_light) ? 1 : 0;
        std::optional<LightRows>& rows = rows_[std::size_t(fast)];
        if (!rows) rows = fast == 1 ? RowsAlongY(*extinction_) : RowsAlongX(*extinction_);
        FindTransmittance(*extinction_, *rows, to_light, shading.shadows, reached.data());
      }
      PackShares(OpenAlong(light->fast), reached, fast, i, *light);
    }
    made_.Put(lit, light);
    made_.DropBeyond(kMostMade);
    return light;
  }

 private:
  static constexpr std::size_t kMostMade = 2;

  void FindOpen(const Shading& shading) {
    const std::pair wanted(shading.ambient_occlusion, shading.occlusion_radius);
    if (open_of_ == wanted) return;
    open_.clear();
    open_along_y_.clear();
    open_of_ = wanted;
    if (!(shading.ambient_occlusion > 0)) return;
    const Vec3 sides = ToVec3(extinction_->size) * extinction_->spacing;
    open_.resize(extinction_->each.size());
    const float strength = shading.ambient_occlusion;
    FindOpenness(*extinction_, shading.occlusion_radius * std::max({sides.x, sides.y, sides.z}),
                 [&](std::size_t first, std::span<const float> row) { KeepOpen(row, strength, open_.data() + first); });
  }

  const Bytes255& OpenAlong(int fast) {
    if (fast == 0 || open_.empty()) return open_;
    if (open_along_y_.empty()) open_along_y_ = TurnedBytes(open_, extinction_->size);
    return open_along_y_;
  }

  const MatterKey key_;
  std::mutex mutex_;
  std::optional<Extinction> extinction_;
  std::array<std::optional<LightRows>, 2> rows_;  // along x and y
  std::optional<std::pair<float, float>> open_of_;
  Bytes255 open_, open_along_y_;  // the latter as it is asked for; empty: all is open
  LruMap<Lit, std::shared_ptr<const FrameLight>> made_;
};

// The latest looks. The oldest one goes.
class LightCache {
 public:
  std::shared_ptr<Matter> Of(const FrameSetup& setup) {
    constexpr std::size_t kMostLooks = 2;  // SharedBytes counts as many
    MatterKey key = KeyOf(setup);
    const std::lock_guard lock(mutex_);
    if (const auto* found = looks_.Find(key)) return *found;
    const auto matter = std::make_shared<Matter>();
    looks_.Put(std::move(key), matter);
    looks_.DropBeyond(kMostLooks);
    return matter;
  }

 private:
  std::mutex mutex_;
  LruMap<MatterKey, std::shared_ptr<Matter>> looks_;
};

}  // namespace

FrameLight::View FrameLight::Seen(const GridMap& map) const {
  View view{.shares = shares.data(), .lights = lights, .fast = fast, .stride = stride, .light = light};
  for (int axis = 0; axis < 3; ++axis) {
    const auto i = std::size_t(axis);
    view.scale[i] = float(double(scale[i]) / map.scale[axis]);
    view.offset[i] = float(double(offset[i]) - double(scale[i]) * map.offset[axis] / map.scale[axis]);
    view.last[i] = float(size[axis] - 1);
  }
  return view;
}

FrameLight::Shares FrameLight::At(const Vec3& p) const {
  std::array<std::int32_t, 3> below{};
  std::array<float, 3> t{};
  for (int axis = 0; axis < 3; ++axis) {
    const auto i = std::size_t(axis);
    const float at = std::clamp(float(p[axis]) * scale[i] + offset[i], 0.0F, float(size[axis] - 1));
    below[i] = std::int32_t(at);
    t[i] = at - float(below[i]);
  }
  const std::size_t f = std::size_t(fast), u = fast == 0 ? 1 : 0;
  const auto y = std::int32_t(t[u] * 256 + 0.5F), z = std::int32_t(t[2] * 256 + 0.5F);
  const std::int32_t yz = y * z >> 8;
  Shares result;
  for (int n = 0; n < lights; ++n) {
    const auto share = [&](std::int32_t byte) {
      const std::uint8_t* at = shares.data() + n * light + below[0] * stride[0] + below[1] * stride[1] + below[2] * stride[2] + byte;
      const auto sum = [&](std::int32_t x) {
        return float((256 - y - z + yz) * at[x] + (y - yz) * at[x + stride[u]] + (z - yz) * at[x + stride[2]] +
                     yz * at[x + stride[u] + stride[2]]);
      };
      return (sum(0) + t[f] * (sum(2) - sum(0))) * (1.0F / (255 * 256));
    };
    result.open = share(0);
    result.reached[std::size_t(n)] = share(1);
  }
  return result;
}

std::shared_ptr<const FrameLight> MakeFrameLight(const LightValues& values, const FrameSetup& setup,
                                                 std::span<const std::shared_ptr<const VoxelBlock>> shapes) {
  static LightCache cache;
  return cache.Of(setup)->Of(values, setup, shapes);
}

}  // namespace slabstream
