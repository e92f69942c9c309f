#include <fmt/format.h>

#include <algorithm>

#include "laboratory/experiments/paper/render_alone.h"
#include "laboratory/experiments/paper/setup.h"
#include "laboratory/measure/point_zbuffer.h"
#include "laboratory/measure/thread_time.h"

namespace slabstream {
namespace {

constexpr double kMagnified[] = {1, 1.5, 2};  // pixels a voxel
constexpr int kRuns = 3;

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
  if (seconds != nullptr) *seconds = MedianSecondsOf(kRuns, draw);
  return points;
}

std::vector<bool> CoveredByFaces(ExperimentContext& context, const PointsCase& of) {
  const Picture picture = RenderAlone(context, of.frame.volume, of.frame.view, of.side());
  const PixelBounds& bounds = picture.image.bounds;
  std::vector<bool> covered(std::size_t(of.side()) * std::size_t(of.side()));
  std::size_t i = 3;  // the alpha of a pixel
  for (int y = bounds.y_begin; y < bounds.y_end; ++y) {
    for (int x = bounds.x_begin; x < bounds.x_end; ++x, i += 4) {
      covered[std::size_t(y) * std::size_t(of.side()) + std::size_t(x)] = picture.image.rgba[i] > 0;
    }
  }
  return covered;
}

// Transform and Z-buffer without shading, which is all that the points do. Stages are in elapsed time; their share of the rendering's
// processor time leaves out what else the machine did.
Estimate SecondsOfFaces(const PaperSetup& setup, const PointsCase& of) {
  std::vector<double> seconds;
  for (const MeasuredFrame& repeat : RecallRepeats(setup.context(), of.frame)) {
    const auto stage = [&](Stage s) { return repeat.StageSeconds(s); };
    seconds.push_back(repeat.RenderSeconds() * (stage(Stage::kTransform) + stage(Stage::kZBuffer)) / stage(Stage::kRender));
  }
  return MedianOf(std::move(seconds));
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
    add("points", "run_time", EstimateOf(setup.context().log(), of.Key(), "seconds"));
    add("faces", "run_time", SecondsOfFaces(setup, of));
    const PointZBuffer points = Draw(of, *setup.context().volumes().Get(of.frame.volume).volume);
    const auto [holes, covered] = points.HolesIn(CoveredByFaces(setup.context(), of));
    add("covered pixels", "count", double(covered));
    add("holes", "count", double(holes));
  }
}

}  // namespace slabstream
