#include "client/report/frame_json.h"

#include "common/json/json.h"

namespace slabstream {

Json LevelsJson(const FrameStatistics& statistics) {
  Json levels = Json::array();
  for (const auto& [level, boxes, voxels] : statistics.levels) levels.push_back({{"level", level}, {"boxes", boxes}, {"voxels", voxels}});
  return levels;
}

Json BytesJson(const FrameSummary& summary) {
  return {{"voxels", summary.voxel_bytes}, {"stored", summary.stored_bytes}, {"images", summary.image_bytes}};
}

}  // namespace slabstream
