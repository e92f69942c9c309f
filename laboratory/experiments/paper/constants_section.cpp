#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <utility>

#include "laboratory/experiments/paper/measures.h"
#include "laboratory/experiments/paper/printed.h"
#include "laboratory/measure/cost_fit.h"
#include "laboratory/report/text.h"

namespace slabstream {
namespace {

constexpr double kNanoseconds = 1e9;
constexpr double kPixels = double(printed::kSize) * printed::kSize, kVoxels = kPixels * printed::kSize, kOccupied = 0.05 * kVoxels;
const double kRounds = std::log2(30);

// One constant of Eq. 21 or 25: its unit, the printed value, and the value that follows from the printed times of table 5 or 6 for N = 200,
// C = 5 %, I = N, p = 1 (combining: p = 30).
struct Term {
  std::string symbol, unit;
  double printed = 0, from_times = 0;
  std::vector<double> values;  // seconds a unit here, one for each (N, p)
};

std::vector<Term> SplattingTerms() {
  const auto& constants = printed::kSplattingConstants;
  const auto share = [](std::size_t stage, std::size_t p) {
    return printed::kSplattingShares[stage][p] / 100 * printed::kSplattingSeconds[p];
  };
  return {{"ct", "voxel transformed", constants[0].seconds, share(0, 0) / kVoxels, {}},
          {"csh", "drawn voxel shaded", constants[1].seconds, share(1, 0) / kOccupied, {}},
          {"csp k²", "drawn voxel splatted", constants[2].seconds, share(2, 0) / kOccupied, {}},
          {"ccp", "pixel and slice composited", constants[3].seconds, share(3, 0) / (kPixels * printed::kSize), {}},
          {"cco", "pixel and round combined", constants[4].seconds, share(4, 6) / (kPixels * kRounds), {}}};
}

std::vector<Term> ZBufferTerms() {
  const auto& constants = printed::kZBufferConstants;
  const auto share = [](std::size_t stage, std::size_t p) { return printed::kZBufferShares[stage][p] / 100 * printed::kZBufferSeconds[p]; };
  return {{"ct", "voxel transformed", constants[0].seconds, share(0, 0) / kVoxels, {}},
          {"cz", "face that may touch pixels", constants[1].seconds, share(1, 0) / kOccupied, {}},
          {"csh", "covered pixel shaded", constants[2].seconds, share(2, 0) / kPixels, {}},
          {"cco", "pixel and round combined", constants[3].seconds, share(3, 6) / (kPixels * kRounds), {}}};
}

void Note(Term& term, double seconds, double units) {
  if (units > 0 && seconds > 0) term.values.push_back(seconds / units);
}

void Collect(const PaperSetup& setup, const RendererKind* renderer, std::vector<Term>& terms) {
  const MachineModel machine = setup.Machine(renderer);
  for (const int size : setup.sizes()) {
    for (const int p : setup.workers()) {
      const FrameCase frame = setup.Frame(renderer, size, p);
      const MeasuredFrame measured = Recall(setup.context(), frame);
      double occupied = 0, covered = 0;
      for (const MeasuredFrame::Cost& box : measured.boxes) {
        occupied += box.drawn_voxels;
        covered += box.covered_pixels;
      }
      const auto pixels = double(FrameBounds(measured.plan.setup).pixel_count());
      const double voxels = double(size) * size * size;
      const auto seconds = [&](Stage stage) { return measured.StageSeconds(stage); };
      Note(terms[0], seconds(Stage::kTransform), voxels);
      if (renderer == Splatting()) {
        Note(terms[1], seconds(Stage::kShade), occupied);
        Note(terms[2], seconds(Stage::kSplat), occupied);
        Note(terms[3], seconds(Stage::kComposite), pixels * size);
      } else {
        Note(terms[1], seconds(Stage::kZBuffer), occupied);
        Note(terms[2], seconds(Stage::kShade), covered);
      }
      if (p == 1) continue;
      const PaperFrame counted = CountAsPaper(setup, frame, machine);
      Note(terms.back(), counted.combine_seconds, pixels * std::log2(p));
    }
  }
}

Table TableOf(const std::string& name, const std::string& title, const std::vector<Term>& terms) {
  Table table{name,
              title,
              {"constant", "a unit is a", "here: median (ns)", "here: largest (ns)", "paper: printed bound (ns)",
               "paper: from its times (ns)", "from its times / here"},
              {}};
  for (const Term& term : terms) {
    const Origin origin = term.symbol == "cco" ? Origin::kSimulated : Origin::kMeasured;
    std::vector<double> values = term.values;
    for (double& value : values) value *= kNanoseconds;
    std::vector<Cell> row = {term.symbol, term.unit};
    if (values.empty()) {
      row.resize(4);
    } else {
      row.insert(row.end(), {Cell(MedianOf(values), origin), Cell(*std::ranges::max_element(values), origin)});
    }
    row.insert(row.end(), {FromPaper(term.printed * kNanoseconds), FromPaper(term.from_times * kNanoseconds)});
    row.push_back(values.empty() ? Cell() : Cell(term.from_times * kNanoseconds / MedianOf(values).median, origin));
    table.rows.push_back(std::move(row));
  }
  return table;
}

// The model of our own stages (laboratory/measure/cost_model.h), fitted to every slab of every N and p. Stages that never took any time, as
// in very small runs, are left out.
struct Fit {
  Table table;
  std::string errors;  // "shade 4 %, splat 12 %"
};
Fit FitModel(const PaperSetup& setup, const RendererKind* renderer, const std::string& name, const std::string& title) {
  std::vector<CostSample> samples;
  for (const int size : setup.sizes()) {
    for (const int p : setup.workers()) {
      const MeasuredFrame measured = Recall(setup.context(), setup.Frame(renderer, size, p));
      for (const MeasuredFrame::Cost& box : measured.boxes) {
        if (box.seconds <= 0) continue;
        CostSample& sample = samples.emplace_back(CostSample{.work = box.work, .stage_ns = {}});
        for (std::size_t stage = 0; stage < sample.stage_ns.size(); ++stage)
          sample.stage_ns[stage] = std::int64_t(box.stage_seconds[stage] * kNanoseconds);
      }
    }
  }
  Fit fit{{name, title, {"stage", "the paper's term", "a unit is a", "time a unit (ns)", "residual (%)", "prediction error (%)"}, {}}, ""};
  for (const StageModel& stage : CostModelOf(renderer->name())) {
    const Result<StageFit> fitted = FitStage(stage, samples);
    if (!fitted.ok()) continue;
    bool first = true;
    for (const TermFit& term : fitted->terms) {
      std::vector<Cell> row = {first ? std::string(ToString(stage.stage)) : "", first ? std::string(stage.symbol) : "",
                               std::string(ToString(term.unit))};
      Cell constant(term.seconds * kNanoseconds, Origin::kMeasured);
      constant.low = term.low * kNanoseconds;
      constant.high = term.high * kNanoseconds;
      row.push_back(std::move(constant));
      if (first) row.insert(row.end(), {Measured(100 * fitted->residual), Measured(100 * fitted->prediction_error)});
      row.resize(fit.table.columns.size());
      fit.table.rows.push_back(std::move(row));
      first = false;
    }
    fit.errors += fmt::format("{}{} {:.0f} %", fit.errors.empty() ? "" : ", ", ToString(stage.stage), 100 * fitted->prediction_error);
  }
  return fit;
}

// "cco 980, ct 290": what each term gained, most first.
std::string GainsOf(const std::vector<Term>& terms) {
  std::vector<std::pair<double, std::string>> gains;
  for (const Term& term : terms) {
    if (!term.values.empty()) gains.emplace_back(term.from_times / MedianOf(term.values).median, term.symbol);
  }
  std::ranges::sort(gains, std::greater());
  std::string text;
  for (const auto& [gain, symbol] : gains) text += fmt::format("{}{} {}", text.empty() ? "" : ", ", symbol, FormatAbout(gain));
  return text;
}

}  // namespace

Section ConstantsSection(const PaperSetup& setup) {
  std::vector<Term> splatting = SplattingTerms(), zbuffer = ZBufferTerms();
  Collect(setup, Splatting(), splatting);
  Collect(setup, ZBuffer(), zbuffer);

  const Fit splatting_fit = FitModel(setup, Splatting(), "fit-splatting", "Our own model of splatting, fitted");
  const Fit zbuffer_fit = FitModel(setup, ZBuffer(), "fit-zbuffer", "Our own model of the Z-buffer, fitted");

  Section section;
  section.title = "Constants: tables 3 and 4";
  section.question = "What does a unit of work of each stage cost, by the paper's equations 21 and 25 and by a model of our own stages?";
  section.method =
      "Tables 3 and 4: each stage's time over all workers of a frame, divided by the units that the paper's equations give it, for every N "
      "and p; the median and its interval. The paper prints upper bounds, and these lie far above the times it prints: its ct N³ would be "
      "104 s where table 5 leaves 1.5 s to the transform. So the constants that tables 5 and 6 give at p = 1 (combining: p = 30, I = N, C "
      "= 5 %) stand there too. Below them: our stages do not all grow as the paper's equations say, since empty space is skipped and "
      "the filter is separable, so a model with our own units is fitted to every slab of every N and p (least squares of relative "
      "residuals, "
      "none below 0), with 95 % intervals. Residual: root mean square of what the fit leaves, relative. Prediction error: mean error "
      "of predicting a fifth of the slabs from the other four fifths, over the mean time.";
  section.answer = fmt::format(
      "What the paper's times give for a unit, over what it takes one processor of today: splatting {}; Z-buffer {}. We count "
      "drawn voxels and faces where the paper counts occupied voxels, and skip empty space. The fitted model predicts slabs it has not "
      "seen with a "
      "mean error of: {} (splatting); {} (Z-buffer). Frames are simulated from measured slabs, not from constants.",
      GainsOf(splatting), GainsOf(zbuffer), splatting_fit.errors, zbuffer_fit.errors);
  section.blocks = {TableOf("table-3-constants-splatting", "Table 3. Splatting, Eq. 21", splatting),
                    TableOf("table-4-constants-zbuffer", "Table 4. Z-buffer, Eq. 25", zbuffer), splatting_fit.table, zbuffer_fit.table};
  return section;
}

}  // namespace slabstream
