// Levels: which levels of a dataset a request draws, and what the request says in terms of one of them.
//
// Positions in the world are the same at all levels. What a request says in voxels, in percent of the volume or in terms of its bounding
// sphere means the finest level. So a picture shows the same part of the world at the same scale, whichever level it is drawn from.
//
// Pure.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "common/base/status.h"
#include "common/frame/frame_request.h"
#include "common/planning/level_map.h"
#include "common/volume/summary.h"

namespace slabstream {

struct VolumeLevels {
  std::vector<VolumeDescription> levels;  // finest first; more than one
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
// from the coarsest level that suits its nearest point. A request with isosurfaces is drawn from one level: two levels do not agree on
// where a surface meets their border.
//
// Errors of ResolveRequest and MakeFrameSetup; InvalidArgument: there is no such level; the message says which there are.
Result<LevelMap> LevelsOf(const FrameRequest& request, const VolumeLevels& levels);

// `map`, if its levels have at most so many bytes of voxels; else the finest level that has, or the coarsest one.
LevelMap NoneLarger(LevelMap map, std::int64_t bytes, const VolumeLevels& levels);

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
                              const std::shared_ptr<const VolumeSummary>& overview, const std::optional<Ball>& framed = {});

// The request that shows of `level` what `request` shows of `finest`. `level` describes the same part of the world.
FrameRequest AtLevel(FrameRequest request, const VolumeGeometry& finest, const VolumeGeometry& level);

}  // namespace slabstream
