// LabWorker: renders boxes in this process like a worker of one render thread, and measures the time: from a box's own voxels and halo,
// kept by bricks, by the same pipelines.
#pragma once

#include <map>
#include <memory>
#include <span>

#include "common/image/local_image.h"
#include "common/mesh/mesh_part.h"
#include "common/planning/frame_plan.h"
#include "common/stats/report.h"
#include "common/volume/volume.h"
#include "worker/renderers/renderer.h"

namespace slabstream {

struct BoxRendering {
  LocalImage image;
  RankReport report;
  double processor_seconds = 0;  // time of the calling thread: excludes all other work of the machine
  double seconds = 0;            // elapsed
};

class LabWorker {
 public:
  explicit LabWorker(const Volume& volume);  // outlives the worker
  ~LabWorker();

  // `box` lies inside the volume and is not empty; `setup` is of this volume (FramePlan::setup). Other boxes hide nothing. Runs on the
  // calling thread alone; one call at a time. The first rendering of a padded box cuts out its voxels (not timed) and makes the data that
  // workers keep between frames (timed): classification, normals, occupied voxels. All padded boxes are kept, until KeepOnly.
  BoxRendering Render(const Box& box, const FrameSetup& setup);
  // Drops what is held of all other boxes.
  void KeepOnly(std::span<const Box> boxes, const FrameSetup& setup);

 private:
  const Volume& volume_;
  std::unique_ptr<MeshCutter> cells_;  // the cells of an unstructured grid
  const RendererKind* kind_ = nullptr;
  std::unique_ptr<Renderer> renderer_;
  std::map<Box, std::unique_ptr<BoxData>> boxes_;  // with halo
};

}  // namespace slabstream
