#include "worker/renderers/raycast/ray_labels.h"

#include <algorithm>
#include <cmath>

#include "worker/rays/field_map.h"

namespace slabstream {

LabelTables MakeLabelTables(const LabelLook& look, const std::vector<LabelStyle>& styles, double steps_per_voxel, double opacity_distance) {
  LabelTables tables;
  tables.surface = look.mode == LabelMode::kSurface;
  tables.smooth = look.smooth;
  tables.tint = tables.surface ? 0 : float(look.tint);
  tables.steps_a_length = float(steps_per_voxel * opacity_distance);
  for (const auto& [color, opacity, shown] : styles) {
    const double of_step = -std::expm1(std::log1p(-double(opacity)) / steps_per_voxel);
    tables.entries.insert(tables.entries.end(), {color.r, color.g, color.b, !shown ? -1 : tables.surface ? float(of_step) : opacity});
  }
  return tables;
}

Result<std::optional<RayLabels>> LabelsFor(const BoxData& data, const LevelBox& at, const FrameSetup& setup, double steps_per_voxel) {
  const FieldSetup* const field = LabelsOf(setup);
  BoxData* const box = field == nullptr ? nullptr : data.fields().back();
  if (box == nullptr) return std::optional<RayLabels>();
  auto& volume = box->CacheOf<LabelVolume>();
  const Result<const NumberedLabels*> numbered = volume.Of(*box);
  if (!numbered.ok()) return numbered.status();
  const std::vector<LabelStyle>& styles = volume.StylesOf(*field->labels);
  const RayPiece& numbers = (*numbered)->numbers;
  RayLabels labels{.tables = MakeLabelTables(*field->labels, styles, steps_per_voxel, setup.transfer.opacity_distance),
                   .voxels = BoxOfVoxels(numbers.voxels, numbers.cells.counts),
                   .map = AffineMapBetween(GeometryOf(setup, at.level), LevelOf(*field, at.level).description.geometry),
                   .numbers = &numbers,
                   .matter = MatterNumbers(field->labels->mode, styles)};
  const FieldMap reach = MakeFieldMap(at, setup, *field);
  for (const Axis axis : kAxes) {
    const auto i = std::size_t(Number(axis));
    labels.steps.at(i) = ToFloat3(labels.map.steps.at(i));
    // Kernels read as far as the padding.
    labels.low.at(i) = std::max(reach.low.at(i), float(numbers.voxels.box.begin[axis]) - 0.5F);
    labels.high.at(i) = std::min(reach.high.at(i), float(numbers.voxels.box.end[axis]) - 0.5F);
  }
  labels.offset = ToFloat3(labels.map.offset);
  return std::optional(std::move(labels));
}

}  // namespace slabstream
