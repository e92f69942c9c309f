// The accuracy of the simulation: frames of the embedded service with one and two workers beside their simulation
// (laboratory/measure/validate.h).
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "bench/program.h"
#include "common/base/check.h"
#include "laboratory/measure/calibrate.h"
#include "laboratory/measure/validate.h"
#include "laboratory/measure/wake_up_probe.h"

namespace slabstream {
namespace {

struct Options {
  std::vector<std::string> cases;
  int size = 512, views = 4, turns = 15;
  const RendererKind* renderer = nullptr;  // null: that of each case
};

std::string Microseconds(const Estimate& e) { return fmt::format("{:.1f} us [{:.1f}, {:.1f}]", e.median * 1e6, e.low * 1e6, e.high * 1e6); }

std::string Percent(const Estimate& e) { return fmt::format("{:.1f} % [{:.1f}, {:.1f}]", e.median * 100, e.low * 100, e.high * 100); }

void PrintMachine() {
  WakeUpProbe probe;
  CHECK(probe.Sample(kCalibrationSamples).ok());
  const WakeUpEstimates wake_ups = probe.Estimates();
  const CombiningCosts c = ThisHost(2).combining;
  fmt::print(
      "ns a pixel: scan {:.3f}, encode {:.3f}, combine {:.3f}, local {:.3f}, hidden {:.3f}; wake-up to a thread that is awake {}, asleep "
      "{}\n",
      c.scan_pixel * 1e9, c.encode_pixel * 1e9, c.combine_pixel * 1e9, c.local_pixel * 1e9, c.hidden_pixel * 1e9,
      Microseconds(wake_ups.awake), Microseconds(wake_ups.asleep));
}

void Validate(const BenchCase& c, const std::shared_ptr<const Volume>& volume, const Options& options) {
  for (const int workers : {1, 2}) {
    ValidationCase what{c.name, volume, BenchRequest(c, BenchView(Projection::kOrthographic, 0, 1), {options.size, options.size}), workers};
    const ValidationRow row = ValidateSimulation(what, {options.views, options.turns}).value();
    const auto parts = [](const FrameParts& p, double low, double high) {
      return fmt::format("{:6.2f} ms [{:.2f}, {:.2f}] (render {:.2f}, picture {:.2f}, beside {:.2f})", p.latency * 1e3, low * 1e3,
                         high * 1e3, p.render * 1e3, p.picture * 1e3, (p.latency - p.render - p.picture) * 1e3);
    };
    const ValidatedView mean = row.Mean();
    const double worst = std::ranges::max(row.views, {}, [](const ValidatedView& view) { return std::abs(view.error()); }).error();
    fmt::print("{} {} workers: measured {}, simulated {}, off by {:+.1f} %, at worst {:+.1f} %; wake-ups {}, {}{}\n", row.name, row.workers,
               parts(mean.measured, mean.measured_low, mean.measured_high), parts(mean.simulated, mean.simulated_low, mean.simulated_high),
               row.error() * 100, worst * 100, Microseconds(row.wake_ups.awake), Microseconds(row.wake_ups.asleep),
               workers == 2 ? ", slowdown " + Percent(row.slowdown) : "");
    (void)std::fflush(stdout);
  }
}

// Errors: as ParseBenchCase and LoadBenchVolume.
Status Run(const Options& options) {
  PrintMachine();
  for (const std::string& text : options.cases) {
    Result<BenchCase> c = ParseBenchCase(text, false);
    if (!c.ok()) return c.status();
    if (options.renderer != nullptr) c->renderer = options.renderer;
    const Result<std::shared_ptr<const Volume>> volume = LoadBenchVolume(*c);
    if (!volume.ok()) return volume.status();
    Validate(*c, *volume, options);
  }
  return Status::Ok();
}

void AddOptions(const Command& app, Options& options) {
  app.AddTexts("CASE", options.cases, "Standard cases of `slabstream bench`, or FILE[:TRANSFER]").Required();
  AddInteger(app, "--size", options.size, 16, 2048, "Pixels a side");
  AddInteger(app, "--views", options.views, 1, 1000, "Azimuths over a turn");
  AddInteger(app, "--turns", options.turns, 1, 1000, "Frames of each view, measured and simulated");
  AddRenderer(app, options.renderer, "Instead of the case's");
}

}  // namespace
}  // namespace slabstream

int main(int argc, char** argv) {
  return slabstream::BenchMain(argc, argv, "simulation_bench", "Frames of the service beside simulated ones", slabstream::AddOptions,
                               slabstream::Run);
}
