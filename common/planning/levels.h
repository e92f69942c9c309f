// Levels: which levels of a dataset a request draws, and what the request says in terms of one of them.
//
// Positions in the world are the same at all levels. What a request says in voxels, in percent of the volume or in terms of its bounding
// sphere means the finest level. So a picture shows the same part of the world at the same scale, whichever level it is drawn from.
//
// Pure.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "common/base/status.h"
#include "common/frame/frame_request.h"
#include "common/planning/level_map.h"
#include "common/planning/shown_fields.h"
#include "common/volume/summary.h"

namespace slabstream {

struct VolumeLevels {
  std::vector<VolumeDescription> levels;  // finest first; more than one
  // Of an adaptive mesh: where each level has voxels of its own, those of the next coarser level tell the others. Null: everywhere. Empty:
  // it is none.
  std::vector<std::shared_ptr<const std::vector<Box>>> refined = {};
  bool owned = false;  // boxes are those of owners, which have no order by which levels could meet: pictures have one level
  // The summary of the level that statistics are taken from: its range and histogram are those of the dataset, at every
  // level.
  std::shared_ptr<const VolumeSummary> overview;
};

// The dataset's statistics, without bricks.
VolumeSummary StatisticsOf(const VolumeLevels& levels);

// The coarsest level whose voxels are at most request.detail pixels wide (0: as 1) wherever the picture shows the volume, or the one that
// request.level names. Counts are those axes along which a level has coarser voxels than the finest one.
//
// In perspective, far parts need coarser voxels than near ones. If the renderer has Ability::kLevels, each zone of a regular grid is drawn
// from the coarsest level that suits its nearest point. In an adaptive mesh no zone is drawn from a level that has no voxels of its own
// there, whatever the projection. A request with isosurfaces is drawn from one level: two levels do not agree on
// where a surface meets their border.
//
// Errors of ResolveRequest and MakeFrameSetup; InvalidArgument: there is no such level; the message says which there are.
Result<LevelMap> LevelsOf(const FrameRequest& request, const VolumeLevels& levels, const ShownFields& fields = {});

// `map`, if its levels have at most so many bytes of voxels; else the finest level that has, or the coarsest one.
LevelMap NoneLarger(LevelMap map, std::int64_t bytes, const VolumeLevels& levels);

// Of another field with `levels`: those that belong to the levels of the picture's volume that are drawn, `volume`, finest first. Beside
// the volume's finest level of all, `finest`, stands the coarsest one whose voxels are at most `pixel` wide (DetailOf); beside another one
// it may also have voxels as wide as those of the volume there. So channels of one grid are drawn from the same level.
struct FieldLevels {
  std::vector<int> levels;               // finest first
  std::vector<std::uint32_t> of_volume;  // for each of `volume` its place in `levels`
};
FieldLevels LevelsOfField(const VolumeLevels& levels, const VolumeGeometry& finest, std::span<const VolumeGeometry> volume, double pixel);

// The width of the least pixel in which the picture shows the volume, in the unit of the world, times the detail of the request (0: as 1).
// 0: it names a level. Errors of ResolveRequest and MakeFrameSetup.
Result<double> DetailOf(const FrameRequest& request, const VolumeGeometry& finest, const std::shared_ptr<const VolumeSummary>& overview,
                        const ShownFields& fields);

// The level that the light volume of a dataset is, or is made from: the finest one of at most kMaxLightSide voxels a side, else the
// coarsest.
int LightLevelOf(const VolumeLevels& levels);

// By which view a picture is made.
struct ChosenView {
  ViewParameters view;         // complete, without `fit`, in terms of the finest level
  std::optional<Ball> framed;  // what the picture frames, if its view fits and anything shows
};

// The view of `request` with what it leaves to the volume: angles (WithDefaults), and what it frames. That is `framed`, or what shows by
// the overview, so that pictures from all levels frame the same. `finest`: the overview's geometry, if there is one level. Errors of
// ResolveRequest.
Result<ChosenView> ChooseView(const FrameRequest& request, const VolumeGeometry& finest,
                              const std::shared_ptr<const VolumeSummary>& overview, const std::optional<Ball>& framed = {},
                              const ShownFields& fields = {});

// The request that shows of `level` what `request` shows of `finest`. `level` describes the same part of the world.
FrameRequest AtLevel(FrameRequest request, const VolumeGeometry& finest, const VolumeGeometry& level);

}  // namespace slabstream
