#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "laboratory/experiments/paper/setup.h"
#include "laboratory/measure/point_zbuffer.h"
#include "laboratory/measure/thread_time.h"

namespace slabstream {
namespace {

constexpr double kMagnified[] = {0.5, 1, 1.5, 2};  // pixels a voxel

struct PointsCase {
  FrameCase frame;  // by faces, one worker
  double pixels_a_voxel = 1;
  int side() const { return frame.size.width; }
  Json Key() const { return {{"what", "points"}, {"N", side()}, {"pixels_a_voxel", pixels_a_voxel}}; }
};

std::vector<PointsCase> CasesOf(const PaperSetup& setup) {
  std::vector<int> sizes = {setup.table_size(), setup.large_size()};
  sizes.erase(std::unique(sizes.begin(), sizes.end()), sizes.end());
  std::vector<PointsCase> cases;
  for (const int size : sizes) {
    for (const double magnified : kMagnified) {
      cases.push_back({setup.Frame(ZBuffer(), size, 1), magnified});
      cases.back().frame.view.zoom *= magnified;
    }
  }
  return cases;
}

PointZBuffer Draw(const PointsCase& of, const Volume& volume, double* seconds = nullptr) {
  PointZBuffer points(of.frame.size);
  const TransformMatrix matrix = MatrixOf(MakeCamera(of.frame.view, of.frame.size, volume.description.geometry));
  // Every voxel of a sphere that is not 0 is opaque.
  const auto draw = [&] { points.Draw(matrix, volume.description.geometry.size, volume.block.samples<std::uint8_t>()); };
  draw();
  if (seconds != nullptr) *seconds = MedianSecondsOf(kRunsOfALoop, draw);
  return points;
}

// Of the whole picture; +infinity where there is no face.
std::vector<float> DepthsOfFaces(const PaperSetup& setup, const PointsCase& of) {
  const Picture picture = setup.RenderAlone(of.frame.volume, of.frame.view, of.side());
  const PixelBounds& bounds = picture.image.bounds();
  std::vector<float> depths(std::size_t(of.side()) * std::size_t(of.side()), std::numeric_limits<float>::infinity());
  for (int y = bounds.y_begin; y < bounds.y_end; ++y) {
    picture.image.ReadDepths(y, &depths[std::size_t(y) * std::size_t(of.side()) + std::size_t(bounds.x_begin)]);
  }
  return depths;
}

// Transform and Z-buffer without shading, which is all that the points do.
std::vector<double> SecondsOfFaces(const PaperSetup& setup, const PointsCase& of) {
  return EachOf(RecallRepeats(setup.context(), of.frame),
                [](const MeasuredFrame& repeat) { return repeat.StageSeconds(Stage::kTransform) + repeat.StageSeconds(Stage::kZBuffer); });
}

}  // namespace

std::vector<Trial> PointsTrials(const PaperSetup& setup) {
  std::vector<Trial> trials;
  ExperimentContext& context = setup.context();
  for (const PointsCase& of : CasesOf(setup)) {
    const auto run = [of, &context]() -> Json {
      double seconds = 0;
      (void)Draw(of, *context.volumes().Get(of.frame.volume).volume, &seconds);
      return {{"seconds", seconds}};
    };
    trials.push_back({of.Key(), run, 0.05 + double(of.side()) * of.side() * of.side() * 2e-8});
    trials.push_back(BoxCostTrial(context, of.frame));
    trials.push_back(FinishTrial(context, of.frame));
  }
  return trials;
}

void AddPoints(const PaperSetup& setup, Results& results) {
  for (const PointsCase& of : CasesOf(setup)) {
    Json columns = {{"part", "points"}};
    columns.update(ColumnsOf(of.frame.volume));
    columns.update(Json{{"view", fmt::format("{:g} pixels a voxel", of.pixels_a_voxel)}, {"pixels", of.side()}});
    const auto add = [&](std::string_view variant, std::string_view metric, const auto& value) {
      columns["variant"] = variant;
      results.Add(columns, metric, value, Origin::kMeasured);
    };
    add("points", "run_time", ValuesOf(setup.context().log(), of.Key(), "seconds"));
    add("faces", "run_time", SecondsOfFaces(setup, of));
    const PointZBuffer points = Draw(of, *setup.context().volumes().Get(of.frame.volume).volume);
    const PointZBuffer::Holes holes = points.HolesIn(DepthsOfFaces(setup, of));
    const Volume& volume = *setup.context().volumes().Get(of.frame.volume).volume;
    const TransformMatrix matrix = MatrixOf(MakeCamera(of.frame.view, of.frame.size, volume.description.geometry));
    const std::size_t doubled = points.CountDoubled(matrix, volume.description.geometry.size, volume.block.samples<std::uint8_t>());
    add("doubled pixels", "count", double(doubled));
    add("covered pixels", "count", double(holes.covered));
    add("empty pixels", "count", double(holes.empty));
    add("pixels of voxels behind", "count", double(holes.behind));
  }
}

}  // namespace slabstream
