#include "worker/renderers/raycast/frame_fields.h"

#include <algorithm>

#include "common/base/check.h"
#include "common/parallel/parallel.h"
#include "worker/renderers/raycast/empty_distance.h"
#include "worker/renderers/raycast/field_cells.h"

namespace slabstream {
namespace {

// The inverse of the map's transpose, which maps normals, by its columns.
std::array<Float3, 3> NormalsOf(const AffineMap& map) {
  const auto& [x, y, z] = map.steps;
  const Vec3 yz = Cross(y, z);
  const double volume = Dot(x, yz);
  return {ToFloat3((1 / volume) * yz), ToFloat3((1 / volume) * Cross(z, x)), ToFloat3((1 / volume) * Cross(x, y))};
}

// As a field's axes see the view and the lights.
RayLook LookOf(const FieldLook& field, const VolumeDescription& description, const FrameSetup& setup, double samples_per_voxel) {
  const auto turned = [&](const Vec3& direction) {
    return description.geometry.orientation.FromWorld(setup.description.geometry.orientation.ToWorld(direction));
  };
  Camera camera = setup.camera;
  camera.view_direction = turned(camera.view_direction);
  Shading shading = setup.shading;
  for (Vec3& light : shading.lights) light = turned(light);
  // Weight w: the opacity of a step is 1 - (1 - a)^w, as of a step w times as long.
  return MakeRayLook(Classify(field.transfer, description, field.range), field.transfer, description, camera, shading,
                     samples_per_voxel / field.weight, description.geometry.spacing);
}

}  // namespace

Result<FrameFields> FrameFields::Make(const BoxData& data, const LevelBox& at, const FrameSetup& setup, double samples_per_voxel) {
  FrameFields shown;
  CHECK_EQ(data.fields().size(), setup.fields.size());
  for (std::size_t i = 0; i < setup.fields.size(); ++i) {
    BoxData* const voxels = data.fields()[i];
    const FieldSetup& field = setup.fields[i];
    if (voxels == nullptr || field.labels || !(field.look.weight > 0)) continue;
    const VolumeDescription& description = LevelOf(field, at.level).description;
    const std::vector<RayPiece>& pieces = voxels->CacheOf<RayVolume>().PiecesOf(*voxels);
    if (pieces.size() > 1) return TooLargeForRays(i);
    Field& of = shown.fields_.emplace_back();
    of.piece = &pieces.front();
    of.from_level = AffineMapBetween(GeometryOf(setup, at.level), description.geometry);
    of.look = LookOf(field.look, description, setup, samples_per_voxel);
    of.at.voxels = BoxOfVoxels(of.piece->voxels, of.piece->cells.counts);
    of.at.map = MakeFieldMap(at, setup, field);
    of.at.normals = NormalsOf(of.from_level);
    of.at.over = field.look.blend == Blend::kOver;
    of.at.steps_a_length = setup.flat ? 1 : float(samples_per_voxel * field.look.transfer.opacity_distance);
  }
  return shown;
}

std::vector<RayField> FrameFields::Of(const RayPiece& piece, const RayLook& volume) const {
  std::vector<RayField> fields = {{.voxels = BoxOfVoxels(piece.voxels, piece.cells.counts),
                                   .look = &volume,
                                   .map = {.everywhere = true},
                                   .normals = {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}},
                                   .on_same_grid = true}};
  for (const Field& of : fields_) {
    RayField& field = fields.emplace_back(of.at);
    field.look = &of.look;
    field.on_same_grid = of.from_level.is_identity();
    field.shift = piece.voxels.box.begin - of.piece->voxels.box.begin;
  }
  return fields;
}

std::vector<std::uint16_t> FrameFields::ShownIn(const RayPiece& piece) const {
  const Index3& counts = piece.cells.counts;
  std::vector<std::uint16_t> shown(CountIn(counts));
  for (std::size_t i = 0; i < fields_.size(); ++i) {
    const Field& field = fields_[i];
    const VisibleSamples visible(field.look);
    const auto bit = std::uint16_t(2 * RayFields::kVolume << i);
    const std::vector<std::uint8_t> cells =
        VisibleCells(field.piece->cells, [&](float low, float high) { return visible.AnyMatterBetween(low, high); });
    const std::vector<std::uint8_t> in_cells = CellsThatShow(piece, *field.piece, field.from_level, cells);
    for (std::size_t cell = 0; cell < shown.size(); ++cell) shown[cell] |= in_cells[cell] != 0 ? bit : std::uint16_t{0};
  }
  return shown;
}

FrameFields::Visible FrameFields::visible() const {
  Visible visible;
  for (const Field& of : fields_) {
    visible.fields_.push_back({VisibleSamples(of.look), of.piece->voxels.samples, of.from_level});
  }
  return visible;
}

bool operator==(const FrameFields::Visible& a, const FrameFields::Visible& b) {
  return std::ranges::equal(a.fields_, b.fields_, [](const auto& x, const auto& y) {
    const bool same_voxels = !x.voxels.owner_before(y.voxels) && !y.voxels.owner_before(x.voxels);
    return same_voxels && x.map == y.map && x.samples == y.samples;
  });
}

}  // namespace slabstream
