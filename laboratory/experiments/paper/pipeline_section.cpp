#include <fmt/format.h>

#include <algorithm>
#include <span>
#include <utility>

#include "common/renderers/registry.h"
#include "laboratory/experiments/paper/measures.h"
#include "laboratory/experiments/paper/printed.h"
#include "laboratory/experiments/plots.h"
#include "laboratory/report/charts.h"
#include "laboratory/report/text.h"

namespace slabstream {
namespace {

// One pipeline: names of its tables and figures, its stages, and the paper's numbers.
struct Pipeline {
  const RendererKind* renderer;
  const char* title;
  const char* table;
  const char* figure;
  const char* table_number;                                        // "5", in the paper
  const char* figure_number;                                       // "10"
  std::vector<std::pair<std::string, std::vector<Stage>>> stages;  // the paper's name, ours; combining comes last
  std::span<const double> paper_seconds;
  std::span<const std::array<double, 7>> paper_shares;  // by stage and combining
};

Pipeline PipelineOf(const RendererKind* renderer) {
  if (renderer == Splatting()) {
    return {
        renderer,
        "Splatting: table 5 and figure 10",
        "table-5-splatting",
        "figure-10",
        "5",
        "10",
        {{"transform", {Stage::kTransform}}, {"shade", {Stage::kShade}}, {"splat", {Stage::kSplat}}, {"composite", {Stage::kComposite}}},
        printed::kSplattingSeconds,
        printed::kSplattingShares};
  }
  return {
      renderer,
      "Z-buffer: table 6 and figure 11",
      "table-6-zbuffer",
      "figure-11",
      "6",
      "11",
      {{"transform", {Stage::kTransform}}, {"Z-buffer", {Stage::kZBuffer, Stage::kSplat, Stage::kComposite}}, {"shade", {Stage::kShade}}},
      printed::kZBufferSeconds,
      printed::kZBufferShares};
}

// Shares of a frame's time in per cent, combining last.
std::vector<double> SharesOf(const PaperFrame& frame, const Pipeline& pipeline) {
  std::vector<double> shares;
  for (const auto& [name, stages] : pipeline.stages) {
    double seconds = 0;
    for (const Stage stage : stages) seconds += frame.stage_seconds[std::size_t(stage)];
    shares.push_back(seconds / frame.seconds * 100);
  }
  shares.push_back(frame.combine_seconds / frame.seconds * 100);
  return shares;
}

struct Curve {
  int size = 0;
  std::vector<std::pair<int, PaperFrame>> frames;  // by workers, 1 first
};

LineChart CurvesOf(const std::vector<Curve>& curves, const PaperSetup& setup, const std::string& title, const AxisSpec& y,
                   double (*value)(double one, double seconds, int p), std::span<const double> paper) {
  LineChart chart{title, WorkersAxis(AxisScale::kLinear), y, {}};
  for (const Curve& curve : curves) {
    LineSeries series{fmt::format("N = {}", curve.size), Origin::kSimulated, {}};
    const double one = curve.frames.front().second.seconds;
    for (const auto& [p, frame] : curve.frames) series.points.push_back({double(p), value(one, frame.seconds, p)});
    LineSeries measured{series.name, Origin::kMeasured, {series.points.front()}};
    chart.series.insert(chart.series.end(), {std::move(series), std::move(measured)});
  }
  LineSeries printed_series{fmt::format("N = {}", setup.table_size()), Origin::kPaper, {}};
  for (std::size_t i = 0; i < paper.size(); ++i) {
    const int p = printed::kStageWorkers[i];
    printed_series.points.push_back({double(p), value(paper[0], paper[i], p)});
  }
  chart.series.push_back(std::move(printed_series));
  return chart;
}

double Milliseconds(double, double seconds, int) { return seconds * 1e3; }
double SpeedUp(double one, double seconds, int) { return one / seconds; }
double Efficiency(double one, double seconds, int p) { return 100 * one / seconds / p; }

}  // namespace

Section PipelineSection(const PaperSetup& setup, const RendererKind* renderer) {
  const Pipeline pipeline = PipelineOf(renderer);
  const MachineModel machine = setup.Machine(renderer);
  std::vector<Curve> curves;
  for (const int size : setup.sizes()) {
    Curve& curve = curves.emplace_back(Curve{size, {}});
    for (const int p : setup.workers()) {
      const PaperFrame frame = CountAsPaper(setup, setup.Frame(renderer, size, p), machine);
      curve.frames.emplace_back(p, frame);
    }
  }
  const Curve& tabled = *std::ranges::find(curves, setup.table_size(), &Curve::size);

  // The table, and the same as bars.
  Table table{pipeline.table,
              fmt::format("Table {}. N = {}: a frame and the share of each stage, per cent", pipeline.table_number, tabled.size),
              {"p", "time (ms)"},
              {}};
  BarChart bars{fmt::format("Where a frame's time goes, N = {}", tabled.size),
                "workers p",
                // Shares printed in whole per cent may sum to 101.
                {.label = "share of the frame's time", .unit = "%", .tight = true},
                {},
                {}};
  for (const auto& [name, stages] : pipeline.stages) bars.parts.push_back(name);
  bars.parts.emplace_back("combine");
  for (const std::string& part : bars.parts) table.columns.emplace_back(part + " (%)");
  table.columns.emplace_back("paper: time (s)");
  for (const std::string& part : bars.parts) table.columns.emplace_back("paper: " + part + " (%)");
  for (const auto& [p, frame] : tabled.frames) {
    const std::vector<double> shares = SharesOf(frame, pipeline);
    std::vector<Cell> row = {Chosen(p), {frame.seconds * 1e3, frame.origin}};
    for (const double share : shares) row.emplace_back(share, frame.origin);
    BarGroup group{fmt::format("{}", p), {{"here", frame.origin, shares}}};
    const auto found = std::ranges::find(printed::kStageWorkers, p);
    if (found != printed::kStageWorkers.end()) {
      const auto i = std::size_t(found - printed::kStageWorkers.begin());
      row.emplace_back(pipeline.paper_seconds[i], Origin::kPaper);
      Bar paper{"paper", Origin::kPaper, {}};
      for (const std::array<double, 7>& stage : pipeline.paper_shares) {
        row.emplace_back(stage[i], Origin::kPaper);
        paper.parts.push_back(stage[i]);
      }
      group.bars.push_back(std::move(paper));
    }
    row.resize(table.columns.size());
    table.rows.push_back(std::move(row));
    bars.groups.push_back(std::move(group));
  }

  const auto& [last_p, last] = tabled.frames.back();
  const double one = tabled.frames.front().second.seconds, paper_one = pipeline.paper_seconds[0],
               paper_last = pipeline.paper_seconds.back(), paper_combining = pipeline.paper_shares.back().back() / 100 * paper_last;
  Table curve_table{
      fmt::format("{}-curves", pipeline.figure), "The curves in numbers", {"N", "p", "time (ms)", "speed-up", "efficiency (%)"}, {}};
  for (const Curve& curve : curves) {
    const double alone = curve.frames.front().second.seconds;
    for (const auto& [p, frame] : curve.frames) {
      curve_table.rows.push_back({Chosen(curve.size),
                                  Chosen(p),
                                  {frame.seconds * 1e3, frame.origin},
                                  {alone / frame.seconds, frame.origin},
                                  {100 * alone / frame.seconds / p, frame.origin}});
    }
  }

  const double rendering_gain = paper_one / one, combining_gain = paper_combining / last.combine_seconds;
  Section section;
  section.title = pipeline.title;
  section.question =
      fmt::format("How long does a frame by {} take, how much do p workers gain, and where does the time go?", renderer->title());
  section.method =
      "As the paper did it: class-I spheres, equal slabs, hierarchical combining, one frame at a time, nobody balanced. Slabs are measured "
      "one by one; with p = 1 that is the whole frame. For more workers the combining of whole images is simulated on the paper's bus, "
      "scaled to these processors. Shares are of the frame's time: stages of the worker that renders longest, and what combining adds to "
      "it.";
  if (renderer == ZBuffer()) section.method += " Our Z-buffer transforms a voxel as it draws it: the one stage holds both.";
  section.answer = fmt::format(
      "At N = {}, p = {} the speed-up is {:.1f}, an efficiency of {:.0f} % (the paper at N = 200, p = 30: {:.1f}, {:.0f} %), with {:.0f} % "
      "of the time in combining (the paper: {:.0f} %). One processor takes {:.1f} ms where theirs took {:.0f} s, about {} times less; "
      "combining takes "
      "about {} times less.{}",
      tabled.size, last_p, one / last.seconds, Efficiency(one, last.seconds, last_p), paper_one / paper_last,
      Efficiency(paper_one, paper_last, 30), SharesOf(last, pipeline).back(), pipeline.paper_shares.back().back(), one * 1e3, paper_one,
      FormatAbout(rendering_gain), FormatAbout(combining_gain),
      rendering_gain > combining_gain
          ? " Rendering has gained more than the combining of whole images, so combining weighs more than it did and efficiency falls with "
            "fewer workers."
          : "");
  const std::string figure = pipeline.figure, number = pipeline.figure_number;
  section.blocks = {std::move(table),
                    Figure{figure + "-stages", DrawBars(bars), "Ours and the paper's, side by side."},
                    Figure{figure + "a-time",
                           DrawLines(CurvesOf(curves, setup, fmt::format("Figure {}a: time of a frame", number),
                                              {"time", "ms", AxisScale::kLog}, Milliseconds, pipeline.paper_seconds)),
                           "The paper's curve lies thirty years above ours; what to compare is its bend."},
                    Figure{figure + "b-speed-up",
                           DrawLines(CurvesOf(curves, setup, fmt::format("Figure {}b: speed-up", number),
                                              {"speed-up", "", AxisScale::kLinear, true}, SpeedUp, pipeline.paper_seconds)),
                           "Time of one worker divided by that of p."},
                    Figure{figure + "c-efficiency",
                           DrawLines(CurvesOf(curves, setup, fmt::format("Figure {}c: efficiency", number),
                                              {"efficiency", "%", AxisScale::kLinear, true}, Efficiency, pipeline.paper_seconds)),
                           "Speed-up divided by p."},
                    std::move(curve_table)};
  return section;
}

}  // namespace slabstream
