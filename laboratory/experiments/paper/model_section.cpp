// The paper's numbers, and what the model of its machine makes of them.
#include <fmt/format.h>

#include <span>
#include <string>

#include "laboratory/experiments/paper/printed.h"
#include "laboratory/experiments/paper/setup.h"

namespace slabstream {
namespace {

Json Case(std::string_view part, std::string_view table, const RendererKind* renderer, int workers, std::string_view combine) {
  return {{"part", part},       {"n", printed::kSize}, {"workers", workers}, {"renderer", renderer->name()},
          {"combine", combine}, {"variant", table}};
}

// One printed time and what the model says instead. `table` and `column` name the place where it is printed.
void AddTime(Results& results, const PaperModel& model, const Json& of, const char* metric, double seconds) {
  results.Add(of, metric, seconds, Origin::kPaper);
  const bool frame = std::string_view(metric) == "frame_time";
  const auto combine = of.at("combine").get<std::string>();
  const int workers = of.at("workers").get<int>();
  const double modelled = frame ? model.FrameSeconds(combine, workers) : model.CombineSeconds(combine, workers);
  Json by_model = of;
  by_model["part"] = "paper-model";
  results.Add(by_model, metric, modelled, Origin::kSimulated);
  by_model["variant"] = fmt::format("{}, {}", of.at("variant").get<std::string>(), frame ? "frame" : "combining");
  if (seconds > 0) results.Add(by_model, "error", modelled / seconds - 1, Origin::kSimulated);
}

void AddStages(Results& results, const PaperModel& model, const RendererKind* renderer, const char* table, std::span<const double> seconds,
               std::span<const std::array<double, 7>> shares, std::span<const char* const> stages) {
  for (std::size_t i = 0; i < seconds.size(); ++i) {
    Json of = Case("printed", table, renderer, printed::kStageWorkers[i], "fan-in");
    AddTime(results, model, of, "frame_time", seconds[i]);
    AddTime(results, model, of, "combine_time", seconds[i] * shares.back()[i] / 100);
    for (std::size_t stage = 0; stage < stages.size(); ++stage) {
      of["stage"] = stages[stage];
      results.Add(of, "stage_time", seconds[i] * shares[stage][i] / 100, Origin::kPaper);
    }
  }
}

void AddPrintedConstants(Results& results, const RendererKind* renderer, const char* table, std::span<const printed::Constant> constants) {
  for (const auto& [symbol, seconds] : constants) {
    results.Add({{"part", "printed"}, {"n", printed::kSize}, {"renderer", renderer->name()}, {"variant", table}, {"stage", symbol}},
                "constant", seconds, Origin::kPaper);
  }
}

}  // namespace

void AddModel(const PaperSetup&, Results& results) {
  for (std::size_t i = 0; i < printed::kWorkers.size(); ++i) {
    const auto add = [&](const char* combine, double seconds) {
      AddTime(results, kPaperSplatting, Case("printed", "table 2", Splatting(), printed::kWorkers[i], combine), "frame_time", seconds);
    };
    add("centralized", printed::kCentralized[i]);
    add("fan-in", printed::kHierarchical[i]);
  }
  constexpr std::array<const char*, 4> kSplattingStages = {"transform", "shade", "splat", "composite"};
  constexpr std::array<const char*, 3> kZBufferStages = {"transform", "z_buffer", "shade"};
  AddStages(results, kPaperSplatting, Splatting(), "table 5", printed::kSplattingSeconds, printed::kSplattingShares, kSplattingStages);
  AddStages(results, kPaperZBuffer, ZBuffer(), "table 6", printed::kZBufferSeconds, printed::kZBufferShares, kZBufferStages);
  AddPrintedConstants(results, Splatting(), "table 3", printed::kSplattingConstants);
  AddPrintedConstants(results, ZBuffer(), "table 4", printed::kZBufferConstants);
}

}  // namespace slabstream
