#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "common/renderers/registry.h"
#include "laboratory/experiments/paper/setup.h"
#include "laboratory/report/charts.h"

namespace slabstream {

namespace {

// Shorter frames consist mostly of wake-ups between threads that sleep and are woken.
constexpr double kLongMilliseconds = 5;
constexpr double kGood = 10;  // per cent

std::string Sentence(const std::string& which, const std::vector<double>& errors) {
  if (errors.empty()) return "";
  return fmt::format("{}: {:.0f} % in the median, {:.0f} % at most ({} frames). ", which, MedianOf(errors).median,
                     *std::ranges::max_element(errors), errors.size());
}

// The conclusion from the errors of long frames.
std::string Conclusion(const std::vector<double>& errors) {
  if (errors.empty()) {
    return fmt::format("No frame took {:.0f} ms: this run cannot tell how far to trust times of long frames.", kLongMilliseconds);
  }
  if (MedianOf(errors).median > kGood) {
    return "That is too far off to take any simulated time as it is: other work on the machine, which spoils measured frames before "
           "measured slabs, or something that the model leaves out. Of this run only the measured numbers should be used, and which scheme "
           "or partition is ahead by far.";
  }
  return "So times of long frames, and ratios of them, may be taken as they are; short frames, and with them small N and the Z-buffer, "
         "only "
         "by order of magnitude and for which scheme or partition is ahead.";
}

}  // namespace

Section ValidationSection(const PaperSetup& setup) {
  Table table{"validation", "Simulated and measured frames", {"pipeline", "N", "p", "measured (ms)", "simulated (ms)", "error (%)"}, {}};
  LineChart chart{
      "Simulated frames against measured ones", {"measured frame", "ms", AxisScale::kLog}, {"error of the simulation", "%"}, {}};
  struct Errors {
    std::vector<double> long_frames, short_frames;  // per cent, without sign
  };
  std::map<int, Errors> by_workers;
  double least = std::numeric_limits<double>::infinity(), most = 0;
  for (const int p : setup.MeasuredWorkers()) {
    for (const RendererKind* renderer : {Splatting(), ZBuffer()}) {
      LineSeries series{fmt::format("{}, p = {}", renderer->title(), p), Origin::kSimulated, {}};
      for (const int size : setup.sizes()) {
        const FrameCase frame = setup.Frame(renderer, size, p);
        const Json key = ValidationKey(setup.context(), frame, kValidationTurns);
        const Estimate measured = EstimateOf(setup.context().log(), key, "measured_ms");
        const Estimate simulated = EstimateOf(setup.context().log(), key, "simulated_ms");
        const auto error_against = [&](double ms) { return 100 * (simulated.median / ms - 1); };
        const double error = error_against(measured.median);
        Errors& errors = by_workers[p];
        (measured.median >= kLongMilliseconds ? errors.long_frames : errors.short_frames).push_back(std::abs(error));
        table.rows.push_back(
            {std::string(renderer->title()), Chosen(size), Chosen(p), Measured(measured), Simulated(simulated), Simulated(error)});
        series.points.push_back({measured.median, error, error_against(measured.high), error_against(measured.low)});
        least = std::min(least, measured.median);
        most = std::max(most, measured.median);
      }
      std::ranges::sort(series.points, {}, &LinePoint::x);
      chart.series.push_back(std::move(series));
    }
  }
  for (const double error : {-kGood, kGood}) {
    chart.series.push_back({fmt::format("{:.0f} % off", kGood), Origin::kMeasured, {{least, error}, {most, error}}, true});
  }
  Section section;
  section.title = "How far to trust the simulation";
  section.question = "Where this machine can run the workers, does the simulation say what the service does?";
  section.method =
      "The same frames by the service inside this process, one and two workers of one thread each, one frame in flight; and, turn by turn "
      "between them, simulated from the costs of their slabs on a model of this machine, whose constants are measured by themselves: "
      "operators, wake-ups on frames of another service, and how much two renderers slow each other down. Medians over turns on both "
      "sides. Nothing of the service's own times enters the simulation, which leaves out lost messages and hiding by groups in front.";
  std::vector<double> long_errors;
  for (const auto& [workers, errors] : by_workers) {
    const std::string who = workers == 1 ? "one worker" : fmt::format("{} workers", workers);
    section.answer += Sentence(fmt::format("Frames of {:.0f} ms and more, {}", kLongMilliseconds, who), errors.long_frames);
    section.answer += Sentence(fmt::format("Shorter ones, {}", who), errors.short_frames);
    long_errors.insert(long_errors.end(), errors.long_frames.begin(), errors.long_frames.end());
  }
  section.answer += Conclusion(long_errors);
  section.blocks = {Figure{"validation", DrawLines(chart),
                           "Each marker is a frame of one N; whiskers: interval of the measured time. Between the thin lines simulated and "
                           "measured times agree within 10 %."},
                    std::move(table)};
  return section;
}

}  // namespace slabstream
