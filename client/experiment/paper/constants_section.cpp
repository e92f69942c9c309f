#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "client/experiment/paper/measures.h"
#include "client/experiment/paper/printed.h"

namespace slabstream {
namespace {

constexpr double kNanoseconds = 1e9, kPaperOccupancy = 0.05;
constexpr double kVoxels = double(printed::kSize) * printed::kSize * printed::kSize, kPixels = double(printed::kSize) * printed::kSize;
const double kRounds = std::log2(30);

// One constant of Eq. 21 or 25: what it is a unit of, what is printed, and what the printed times of table 5 or 6 give for N = 200, C = 5
// %, I = N, p = 1 (combining: p = 30).
struct Term {
  std::string symbol, unit;
  double printed = 0, from_times = 0;
  std::vector<double> values;  // seconds a unit here, one for each (N, p)
};

double Share(const std::array<double, 7>& shares, std::size_t at, double seconds) { return shares[at] / 100 * seconds; }

std::vector<Term> SplattingTerms() {
  const auto at_one = [](std::size_t stage) { return Share(printed::kSplattingShares[stage], 0, printed::kSplattingSeconds[0]); };
  const double occupied = kPaperOccupancy * kVoxels;
  return {{"ct", "voxel transformed", printed::kSplattingConstants[0].seconds, at_one(0) / kVoxels, {}},
          {"csh", "occupied voxel shaded", printed::kSplattingConstants[1].seconds, at_one(1) / occupied, {}},
          {"csp k²", "occupied voxel splatted", printed::kSplattingConstants[2].seconds, at_one(2) / occupied, {}},
          {"ccp", "pixel and slice composited", printed::kSplattingConstants[3].seconds, at_one(3) / (kPixels * printed::kSize), {}},
          {"cco",
           "pixel and round combined",
           printed::kSplattingConstants[4].seconds,
           Share(printed::kSplattingShares[4], 6, printed::kSplattingSeconds[6]) / (kPixels * kRounds),
           {}}};
}

std::vector<Term> ZBufferTerms() {
  const auto at_one = [](std::size_t stage) { return Share(printed::kZBufferShares[stage], 0, printed::kZBufferSeconds[0]); };
  const double occupied = kPaperOccupancy * kVoxels;
  return {{"ct", "voxel transformed", printed::kZBufferConstants[0].seconds, at_one(0) / kVoxels, {}},
          {"cz", "occupied voxel drawn", printed::kZBufferConstants[1].seconds, at_one(1) / occupied, {}},
          {"csh", "covered pixel shaded", printed::kZBufferConstants[2].seconds, at_one(2) / kPixels, {}},
          {"cco",
           "pixel and round combined",
           printed::kZBufferConstants[3].seconds,
           Share(printed::kZBufferShares[3], 6, printed::kZBufferSeconds[6]) / (kPixels * kRounds),
           {}}};
}

void Note(Term& term, double seconds, double units) {
  if (units > 0 && seconds > 0) term.values.push_back(seconds / units);
}

Status Collect(const PaperSetup& setup, RendererKind renderer, std::vector<Term>& terms) {
  const Result<MachineModel> machine = setup.Machine(renderer);
  if (!machine.ok()) return machine.status();
  for (const int size : setup.sizes()) {
    for (const int p : setup.workers()) {
      const FrameCase frame = setup.Frame(renderer, size, p);
      const Result<MeasuredFrame> measured = Recall(setup.context(), frame);
      if (!measured.ok()) return measured.status();
      double occupied = 0, covered = 0;
      for (const MeasuredFrame::Cost& box : measured->boxes) {
        occupied += box.drawn_voxels;
        covered += box.covered_pixels;
      }
      const auto pixels = double(FrameBounds(measured->plan.setup).pixel_count());
      const double voxels = double(size) * size * size;
      const auto seconds = [&](Stage stage) { return measured->StageSeconds(stage); };
      Note(terms[0], seconds(Stage::kTransform), voxels);
      if (renderer == RendererKind::kSplat) {
        Note(terms[1], seconds(Stage::kShade), occupied);
        Note(terms[2], seconds(Stage::kSplat), occupied);
        Note(terms[3], seconds(Stage::kComposite), pixels * size);
      } else {
        Note(terms[1], seconds(Stage::kZBuffer), occupied);
        Note(terms[2], seconds(Stage::kShade), covered);
      }
      if (p == 1) continue;
      const Result<PaperFrame> counted = CountAsPaper(setup, frame, *machine);
      if (!counted.ok()) return counted.status();
      Note(terms.back(), counted->combine_seconds, pixels * std::log2(p));
    }
  }
  return Status::Ok();
}

Table TableOf(const std::string& name, const std::string& title, const std::vector<Term>& terms) {
  Table table{name,
              title,
              {{"constant", ""},
               {"a unit is a", ""},
               {"here: median", "ns"},
               {"here: largest", "ns"},
               {"paper: printed bound", "ns"},
               {"paper: from its times", "ns"},
               {"from its times / here", ""}},
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
    row.insert(row.end(), {{term.printed * kNanoseconds, Origin::kPaper}, {term.from_times * kNanoseconds, Origin::kPaper}});
    row.push_back(values.empty() ? Cell() : Cell(term.from_times * kNanoseconds / MedianOf(values).median, origin));
    table.rows.push_back(std::move(row));
  }
  return table;
}

}  // namespace

Result<Section> ConstantsSection(const PaperSetup& setup) {
  std::vector<Term> splatting = SplattingTerms(), zbuffer = ZBufferTerms();
  if (Status status = Collect(setup, RendererKind::kSplat, splatting); !status.ok()) return status;
  if (Status status = Collect(setup, RendererKind::kZBuffer, zbuffer); !status.ok()) return status;

  Section section;
  section.title = "Constants: tables 3 and 4";
  section.question = "What does a unit of work of each stage cost, by the paper's own equations 21 and 25?";
  section.method =
      "Each stage's time over all workers of a frame, divided by the units that the equations give it, for every N and p. The paper prints "
      "upper bounds; "
      "medians with their intervals over all (N, p) stand beside ours, since our stages are not all proportional to the paper's units: "
      "empty space is skipped, so "
      "what the paper counts by voxel and by pixel and slice is here in proportion to what is occupied. The printed bounds lie far above "
      "the printed times: ct N³ would be "
      "104 s where table 5 leaves 1.5 s to the transform. So the constants that tables 5 and 6 give at p = 1 (combining: p = 30, I = N, C "
      "= 5 %) stand there too.";
  const auto ratio = [](const Term& term) { return term.values.empty() ? 0 : term.from_times / MedianOf(term.values).median; };
  section.answer = fmt::format(
      "Today an occupied voxel is shaded {:.0f} and splatted {:.0f} times as fast as the paper's times say, and drawn into a Z-buffer "
      "{:.0f} times; a pixel and slice is composited {:.0f} "
      "times as fast, because empty ones cost nothing.",
      ratio(splatting[1]), ratio(splatting[2]), ratio(zbuffer[1]), ratio(splatting[3]));
  section.blocks = {TableOf("table-3-constants-splatting", "Table 3. Splatting, Eq. 21", splatting),
                    TableOf("table-4-constants-zbuffer", "Table 4. Z-buffer, Eq. 25", zbuffer)};
  return section;
}

}  // namespace slabstream
