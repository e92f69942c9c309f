// The accuracy of the simulation: frames of the embedded service with one and two workers beside their simulation
// (laboratory/measure/validate.h), and the cost model fitted to boxes of all sizes (laboratory/measure/cost_fit.h).
//
//   build/bin/simulation_bench CASE... [--size PIXELS_A_SIDE] [--views N] [--turns N] [--renderer splat|zbuffer] [--fit [--repeats N]]
//
// CASE is one of `slabstream bench --list`, or FILE[:TRANSFER]. With --fit the constants are fitted to the boxes of all cases together.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

#include "common/base/check.h"
#include "common/base/large_buffers.h"
#include "common/planning/placement.h"
#include "common/renderers/registry.h"
#include "laboratory/bench/bench_cases.h"
#include "laboratory/measure/calibrate.h"
#include "laboratory/measure/cost_fit.h"
#include "laboratory/measure/frame_costs.h"
#include "laboratory/measure/validate.h"

namespace slabstream {
namespace {

constexpr int kBoxCounts[] = {1, 2, 5, 12, 30};  // of the samples for the fit of the cost model

struct BenchOptions {
  std::vector<std::string> cases;
  int size = 512, views = 4, turns = 15, repeats = 3;
  std::string renderer;
  bool fit = false;
};

std::string Microseconds(const Estimate& e) { return fmt::format("{:.1f} us [{:.1f}, {:.1f}]", e.median * 1e6, e.low * 1e6, e.high * 1e6); }

std::string Percent(const Estimate& e) { return fmt::format("{:.1f} % [{:.1f}, {:.1f}]", e.median * 100, e.low * 100, e.high * 100); }

void PrintMachine() {
  const Calibration calibration = CalibrateThisHost(2).value();
  const CombiningCosts& c = calibration.machine.combining;
  fmt::print(
      "ns a pixel: scan {:.3f}, encode {:.3f}, combine {:.3f}, local {:.3f}, hidden {:.3f}; wake-up to a thread that is awake {}, asleep "
      "{}; "
      "two halves of a sphere slow each other down by {}\n",
      c.scan_pixel * 1e9, c.encode_pixel * 1e9, c.combine_pixel * 1e9, c.local_pixel * 1e9, c.hidden_pixel * 1e9,
      Microseconds(calibration.wake_ups.awake), Microseconds(calibration.wake_ups.asleep), Percent(calibration.memory_slowdown));
}

void Validate(const BenchCase& c, const std::shared_ptr<const Volume>& volume, const BenchOptions& options) {
  for (const int workers : {1, 2}) {
    ValidationCase what{c.name, volume, BenchRequest(c, BenchView(Projection::kOrthographic, 0, 1), {options.size, options.size}), workers};
    const ValidationRow row = ValidateSimulation(what, {options.views, options.turns}).value();
    const auto parts = [](const FrameParts& p, double low, double high) {
      return fmt::format("{:6.2f} ms [{:.2f}, {:.2f}] (render {:.2f}, picture {:.2f}, beside {:.2f})", p.latency * 1e3, low * 1e3,
                         high * 1e3, p.render * 1e3, p.picture * 1e3, (p.latency - p.render - p.picture) * 1e3);
    };
    const ValidatedView mean = row.Mean();
    fmt::print("{} {} workers: measured {}, simulated {}, off by {:+.1f} %, at worst {:+.1f} %; wake-ups {}, {}{}\n", row.name, row.workers,
               parts(mean.measured, mean.measured_low, mean.measured_high), parts(mean.simulated, mean.simulated_low, mean.simulated_high),
               row.error() * 100, row.worst_error() * 100, Microseconds(row.wake_ups.awake), Microseconds(row.wake_ups.asleep),
               workers == 2 ? ", slowdown " + Percent(row.slowdown) : "");
    (void)std::fflush(stdout);
  }
}

void AddSamples(const BenchCase& c, const Volume& volume, const BenchOptions& options, std::vector<CostSample>& samples) {
  const VolumeSummary summary = Summarize(volume);
  for (int view = 0; view < options.views; ++view) {
    FrameRequest request =
        BenchRequest(c, BenchView(view % 2 == 0 ? Projection::kOrthographic : Projection::kPerspective, view, options.views),
                     {options.size, options.size});
    for (const int boxes : kBoxCounts) {
      const FramePlan plan = PlanFrame(request, 1, summary, RosterOf(std::uint32_t(boxes))).value();
      for (const BoxCost& box : MeasureFrameCosts(volume, plan, options.repeats).boxes) {
        if (box.seconds > 0) samples.push_back(SampleOf(box, plan.setup.camera));
      }
    }
  }
}

void PrintFit(const RendererKind* renderer, const std::vector<CostSample>& samples) {
  const CostFit fit = FitCosts(CostModel().stages(renderer->name()), samples).value();
  for (const StageFit& stage : fit.stages) {
    fmt::print("{:10} {:12} {} boxes, residual {:.1f} %, prediction error {:.1f} %\n", ToString(stage.cost.stage), stage.cost.symbol,
               stage.samples.size(), stage.residual * 100, stage.prediction_error * 100);
    for (const TermFit& term : stage.terms) {
      fmt::print("    {:16} {:10.4f} ns  [{:.4f}, {:.4f}]\n", ToString(term.unit), term.seconds * 1e9, term.low * 1e9, term.high * 1e9);
    }
  }
  fmt::print("all stages: prediction error {:.1f} %\n", fit.prediction_error * 100);
}

// Errors: as ParseBenchCase and LoadBenchVolume.
Status Run(const BenchOptions& options) {
  std::vector<BenchCase> cases;
  for (const std::string& text : options.cases) {
    Result<BenchCase> c = ParseBenchCase(text, false);
    if (!c.ok()) return c.status();
    if (!options.renderer.empty()) c->renderer = RequireRenderer(options.renderer).value();
    cases.push_back(*std::move(c));
  }
  if (!options.fit) PrintMachine();
  std::vector<CostSample> samples;
  for (const BenchCase& c : cases) {
    const Result<std::shared_ptr<const Volume>> volume = LoadBenchVolume(c);
    if (!volume.ok()) return volume.status();
    if (options.fit) {
      AddSamples(c, **volume, options, samples);
    } else {
      Validate(c, *volume, options);
    }
  }
  if (options.fit) PrintFit(cases.back().renderer, samples);
  return Status::Ok();
}

}  // namespace
}  // namespace slabstream

int main(int argc, char** argv) {
  slabstream::KeepFrameBuffers();
  CLI::App app("Frames of the service beside simulated ones");
  slabstream::BenchOptions options;
  app.add_option("case", options.cases, "standard case or FILE[:TRANSFER]")->required();
  app.add_option("--size", options.size, "pixels a side of the picture")->check(CLI::Range(16, 2048))->capture_default_str();
  app.add_option("--views", options.views, "azimuths over a turn")->check(CLI::Range(1, 1000))->capture_default_str();
  app.add_option("--turns", options.turns, "frames of each view, measured and simulated")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  app.add_option("--repeats", options.repeats, "renderings of each box for --fit")->check(CLI::Range(1, 100))->capture_default_str();
  app.add_option("--renderer", options.renderer, "instead of the case's")->check(CLI::IsMember({"splat", "zbuffer"}));
  app.add_flag("--fit", options.fit, "fit the cost model instead");
  CLI11_PARSE(app, argc, argv);
  const slabstream::Status status = slabstream::Run(options);
  if (status.ok()) return 0;
  fmt::print(stderr, "simulation_bench: {}\n", status.message());
  return 2;
}
