#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "laboratory/experiments/paper/measures.h"
#include "laboratory/experiments/paper/printed.h"
#include "laboratory/experiments/plots.h"
#include "laboratory/report/charts.h"
#include "laboratory/report/text.h"

namespace slabstream {
namespace {

// The frame with one of the paper's two schemes.
FrameCase With(FrameCase frame, const char* scheme) {
  frame.policy.combine = scheme;
  return frame;
}

}  // namespace

Section CombiningSection(const PaperSetup& setup) {
  const MachineModel machine = setup.Machine(Splatting());
  Table table{"table-2-combining",
              fmt::format("Table 2. A frame by splatting, N = {}, on the paper's bus scaled to these processors", setup.table_size()),
              {"p", "whole images: centralised (ms)", "whole images: hierarchical (ms)", "whole images: speed-up",
               "without empty pixels: centralised (ms)", "without empty pixels: hierarchical (ms)", "paper: centralised (s)",
               "paper: hierarchical (s)", "paper: speed-up"},
              {}};
  std::array<double, 4> last{};  // seconds; whole images: centralised, hierarchical; the same without empty pixels
  int last_p = 1;
  for (const int p : setup.workers()) {
    if (p == 1) continue;
    const FrameCase frame = setup.Frame(Splatting(), setup.table_size(), p);
    std::vector<Cell> row = {Chosen(p)};
    std::array<double, 4> seconds{};
    std::size_t at = 0;
    for (const Images images : {Images::kWhole, Images::kWithoutEmpty}) {
      for (const char* scheme : {"centralized", "fan-in"}) {
        const PaperFrame counted = CountAsPaper(setup, With(frame, scheme), machine, images);
        seconds[at++] = counted.seconds;
        row.emplace_back(counted.seconds * 1e3, counted.origin);
      }
      if (images == Images::kWhole) row.emplace_back(seconds[0] / seconds[1], Origin::kSimulated);
    }
    last = seconds;
    last_p = p;
    if (const auto found = std::ranges::find(printed::kWorkers, p); found != printed::kWorkers.end()) {
      const auto i = std::size_t(found - printed::kWorkers.begin());
      row.insert(row.end(), {FromPaper(printed::kCentralized[i]), FromPaper(printed::kHierarchical[i]),
                             FromPaper(printed::kCentralized[i] / printed::kHierarchical[i])});
    }
    row.resize(table.columns.size());
    table.rows.push_back(std::move(row));
  }

  LineChart chart{"Figure 9: combining, hierarchical", WorkersAxis(AxisScale::kLinear), {"time", "ms", AxisScale::kLinear, true}, {}};
  Table curve{"figure-9-combining", "Figure 9 in numbers", {"N", "p", "combining (ms)"}, {}};
  double at_half = 0, at_full = 0;
  for (const int size : setup.sizes()) {
    LineSeries series{fmt::format("N = {}", size), Origin::kSimulated, {}};
    for (const int p : setup.workers()) {
      if (p == 1) continue;
      const PaperFrame frame = CountAsPaper(setup, setup.Frame(Splatting(), size, p), machine);
      const double ms = frame.combine_seconds * 1e3;
      series.points.push_back({double(p), ms});
      curve.rows.push_back({Chosen(size), Chosen(p), Simulated(ms)});
      if (p == 5) at_half = ms;
      at_full = ms;
    }
    chart.series.push_back(std::move(series));
  }

  Section section;
  section.title = "Combining: table 2 and figure 9";
  section.question = "What does a tree of workers gain over one worker that combines all images, and how does combining grow with p?";
  section.method =
      "The schedules of Slabstream are run in virtual time with the measured cost of each slab. The machine joins processors like these by "
      "a bus whose time for an image, relative to a frame on one "
      "processor, follows from the paper's centralised times; it counts what the paper counts, until the combined image lies at "
      "one worker. Whole images are "
      "what the paper sends; Slabstream leaves empty pixels out. Combining is what a frame "
      "takes longer than its slowest slab.";
  section.answer = fmt::format(
      "At p = {}, with whole images, the tree is {} as the centralised scheme (the paper at p = {}: {:.1f} times as fast). Without empty "
      "pixels the tree is {} as with whole images, the centralised scheme {}. At "
      "N = {} combining grows {:.1f} times from p = 5 to p = {}, while the workers grow {:.0f} times.",
      last_p, FormatSpeed(last[0] / last[1]), printed::kWorkers.back(), printed::kCentralized.back() / printed::kHierarchical.back(),
      FormatSpeed(last[1] / last[3]), FormatSpeed(last[0] / last[2]), setup.large_size(), at_half > 0 ? at_full / at_half : 0, last_p,
      last_p / 5.0);
  section.blocks = {std::move(table),
                    Figure{"figure-9-combining", DrawLines(chart),
                           "A frame less its slowest slab. The paper prints its curves without numbers (they end below 3.5 s at N = 300); "
                           "from table 5, N = 200, combining takes "
                           "1.4 s at p = 5 and 0.8 s at p = 30."},
                    std::move(curve)};
  return section;
}

}  // namespace slabstream
