#include "laboratory/experiments/frame_case.h"

#include <fmt/format.h>

#include <cmath>
#include <utility>

#include "common/base/check.h"
#include "common/planning/frame_window.h"
#include "common/planning/placement.h"
#include "common/planning/policy_names.h"
#include "common/planning/standard_combining.h"
#include "common/planning/team.h"
#include "common/renderers/registry.h"
#include "common/wire/validate_request.h"
#include "laboratory/experiments/client_frames.h"
#include "laboratory/experiments/compared_policies.h"
#include "laboratory/experiments/frame_keys.h"
#include "laboratory/measure/frame_costs.h"
#include "laboratory/measure/lab_service.h"
#include "laboratory/measure/validate.h"

namespace slabstream {
namespace {

constexpr int kRenderings = 2;  // rounds of box costs
constexpr int kFinishes = 3;

// Counts of non-empty pixels, tile by tile, in the smallest rectangle of tiles that holds all: [x, y, width, height, count, ...].
Json CoverageJson(const CoverageMap& coverage) {
  std::int32_t x_begin = coverage.tiles_x, x_end = 0, y_begin = coverage.tiles_y, y_end = 0;
  for (std::int32_t y = 0; y < coverage.tiles_y; ++y) {
    for (std::int32_t x = 0; x < coverage.tiles_x; ++x) {
      if (coverage.at(x, y) <= 0) continue;
      x_begin = std::min(x_begin, x);
      x_end = std::max(x_end, x + 1);
      y_begin = std::min(y_begin, y);
      y_end = std::max(y_end, y + 1);
    }
  }
  if (x_end <= x_begin) return Json::array();
  Json json = {x_begin, y_begin, x_end - x_begin, y_end - y_begin};
  for (std::int32_t y = y_begin; y < y_end; ++y) {
    for (std::int32_t x = x_begin; x < x_end; ++x) json.push_back(std::lround(coverage.at(x, y) * float(coverage.TilePixels(x, y))));
  }
  return json;
}

CoverageMap CoverageOf(const Json& json, const PixelBounds& frame) {
  CoverageMap coverage = UniformCoverage({}, 0, frame.width(), frame.height());
  if (json.empty()) return coverage;
  const auto x_begin = json[0].get<std::int32_t>(), y_begin = json[1].get<std::int32_t>(), width = json[2].get<std::int32_t>(),
             height = json[3].get<std::int32_t>();
  for (std::int32_t i = 0; i < width * height; ++i) {
    const std::int32_t x = x_begin + i % width, y = y_begin + i / width;
    coverage.share[std::size_t(y) * std::size_t(coverage.tiles_x) + std::size_t(x)] =
        json[std::size_t(i) + 4].get<float>() / float(coverage.TilePixels(x, y));
  }
  return coverage;
}

std::string AnglesOf(const ViewParameters& view) {
  const auto& [projection, azimuth, elevation, roll, zoom, fov, look_at, eye, up, distance, fit, of_patient] = view;
  const auto point = [](const char* what, const std::optional<Vec3>& p) {
    return p ? fmt::format(" {} {:.4g},{:.4g},{:.4g}", what, p->x, p->y, p->z) : std::string();
  };
  std::string name = fmt::format("{:.4g}/{:.4g}", *azimuth, *elevation);
  if (roll != 0) name += fmt::format(" roll {:.4g}", roll);
  if (zoom != 1) name += fmt::format(" zoom {:.4g}", zoom);
  if (projection == Projection::kPerspective) name += fmt::format(" fov {:.4g}", fov);
  if (distance > 0) name += fmt::format(" distance {:.4g}", distance);
  return name + point("at", look_at) + point("from", eye) + point("up", up) + (*fit ? " fit" : "") + (of_patient ? " of a patient" : "");
}

Json MeasureFinish(ExperimentContext& context, const FrameCase& frame) {
  const VolumeInUse volume = context.volumes().Get(frame.volume);
  const FramePlan plan = PlanOf(context, frame);
  const PictureCost cost = MeasurePictureCost(*volume.volume, plan.setup, kFinishes);
  return Json{{"finish_seconds", cost.finish_seconds}, {"receive_seconds", cost.receive_seconds}, {"picture_bytes", cost.bytes}};
}

Json MeasureService(ExperimentContext& context, const FrameCase& frame, int frames) {
  ServiceConnection connection = OrThrow(OpenLabService(frame.workers, {context.volumes().Get(frame.volume).volume}));
  FrameRequest request = RequestOf(frame);
  request.dataset = connection.dataset();
  return MeasureLatency(connection.client(), request, WarmUpFrames(frame.policy), frames);
}

// Relative to other frames: rendering grows with voxels and halos of boxes, and with pixels.
double ExpectedEffort(const FrameCase& frame) {
  const double side = SideOf(frame.volume).value_or(200);
  const double halo = 2.0 * kHalo * std::cbrt(double(frame.workers) * std::max(1, frame.policy.groups));
  return side * side * (side + 3 * halo) * 1e-6 + double(frame.size.width) * frame.size.height * 2e-6 + 0.1;
}

// Two volumes are two datasets, as at a service, so that nothing is known of one from the other.
DatasetId IdOf(const Json& identity) { return std::max<DatasetId>(1, std::stoull(DigestText(identity.dump()), nullptr, 16)); }

FramePlan PlanOf(const ResolvedRequest& resolved, int workers, std::shared_ptr<const Layout> layout) {
  return OrThrow(PlanFrame(OrThrow(MakeFrameSetup(resolved)), resolved.policy, RosterOf(std::uint32_t(workers)), std::move(layout)));
}

KeyedFrame ForService(ExperimentContext& context, const FrameCase& frame, int frames) {
  return WholeCase(context, "service", frame, {{"frames", frames}});
}
KeyedFrame ForValidation(ExperimentContext& context, const FrameCase& frame, int turns) {
  return WholeCase(context, "validation", frame, {{"turns", turns}});
}

Json MeasureValidation(ExperimentContext& context, const FrameCase& frame, int turns) {
  const VolumeInUse volume = context.volumes().Get(frame.volume);
  const ValidationCase what{frame.volume.name, volume.volume, RequestOf(frame), frame.workers};
  const ValidationRow row = OrThrow(ValidateSimulation(what, {.views = 1, .turns = turns}));
  const ValidatedView& view = row.views.front();
  return Json{{"measured_ms", view.measured.latency * 1e3}, {"simulated_ms", view.simulated.latency * 1e3}};
}

}  // namespace

const RendererKind* Splatting() { return FindRenderer("splat"); }
const RendererKind* ZBuffer() { return FindRenderer("zbuffer"); }

FrameRequest RequestOf(const FrameCase& frame) {
  const FrameRequest usual = BenchRequest(frame.volume, frame.view, frame.size);
  FrameRequest request = frame.look;
  request.dataset = usual.dataset;
  request.renderer = usual.renderer;
  request.transfer = usual.transfer;
  request.view = usual.view;
  request.size = usual.size;
  request.policy = frame.policy;
  request.straight8 = true;
  return request;
}

Json ColumnsOf(const FrameCase& frame, Json columns) {
  const auto& [decomposition, balance_by, axis, groups, assignment, balance, combine, pixel_error, teams] = frame.policy;
  const std::int64_t pixels = std::int64_t{frame.size.width} * frame.size.height;
  columns.update(ColumnsOf(frame.volume));
  columns.update(Json{{"workers", frame.workers},
                      {"view", AnglesOf(frame.view)},
                      {"pixels", std::min(frame.size.width, frame.size.height)},
                      {"renderer", frame.volume.renderer->name()},
                      {"decomposition", decomposition},
                      {"axis", NameOf(axis)},
                      {"balance_by", BalanceByOf(frame.policy)},
                      {"assignment", assignment},
                      {"balance", balance},
                      {"combine", combine.empty() ? StandardCombining(std::size_t(frame.workers), pixels) : combine},
                      {"groups", groups},
                      {"teams", teams}});
  return columns;
}

Json MeasureBoxes(ExperimentContext& context, const FrameCase& frame, const FramePlan& plan) {
  return NumbersOf(MeasureBoxCosts(*context.volumes().Get(frame.volume).volume, plan, kRenderings), plan);
}

Json NumbersOf(const std::vector<BoxCost>& costs, const FramePlan& plan) {
  Json numbers = {{"ids", Json::array()}};
  for (const char* list :
       {"seconds", "first_seconds", "occupied_voxels", "drawn_voxels", "covered_pixels", "voxel_bytes", "work", "coverage"}) {
    numbers[list] = Json::array();
  }
  for (int stage = 0; stage < kStageCount; ++stage) numbers["stages"][std::string(ToString(Stage(stage)))] = Json::array();
  for (const Placement& placement : PlacementsOf(plan)) numbers["ids"].push_back(placement.id);
  for (const BoxCost& cost : costs) {
    numbers["seconds"].push_back(cost.seconds);
    numbers["first_seconds"].push_back(cost.first_seconds);
    numbers["occupied_voxels"].push_back(cost.occupied_voxels);
    numbers["drawn_voxels"].push_back(cost.drawn_voxels);
    numbers["covered_pixels"].push_back(cost.covered_pixels);
    numbers["voxel_bytes"].push_back(cost.voxel_bytes);
    numbers["coverage"].push_back(CoverageJson(cost.coverage));
    const CostSample sample = SampleOf(cost, plan.setup.camera);
    numbers["work"].push_back(sample.work);
    for (int stage = 0; stage < kStageCount; ++stage) {
      numbers["stages"][std::string(ToString(Stage(stage)))].push_back(double(sample.stage_ns[std::size_t(stage)]) * 1e-9);
    }
  }
  return numbers;
}

ResolvedRequest Resolve(ExperimentContext& context, const FrameCase& frame) {
  const FrameRequest request = RequestOf(frame);
  OrThrow(Validate(request));
  return OrThrow(ResolveCompared(request, IdOf(context.volumes().Identity(frame.volume)), context.volumes().Get(frame.volume).summary,
                                 std::uint32_t(frame.workers)));
}

FramePlan PlanOf(ExperimentContext& context, const FrameCase& frame) {
  const ResolvedRequest resolved = Resolve(context, frame);
  LayoutRequest request{
      .summary = resolved.summary.get(), .volume = &resolved.volume, .policy = &resolved.policy, .slots = std::uint32_t(frame.workers)};
  const bool counts = NeedsOccupancy(resolved.frame.policy);
  const auto occupied = counts ? context.volumes().Occupied(frame.volume) : nullptr;
  request.known.occupied = occupied.get();
  return PlanOf(resolved, frame.workers, std::make_shared<const Layout>(MakeLayout(request)));
}

FramePlan NextPlan(ExperimentContext& context, const FrameCase& frame, MeasuredLayouts& layouts) {
  const ResolvedRequest resolved = Resolve(context, frame);
  return PlanOf(resolved, frame.workers, layouts.Next(resolved, context.volumes().Occupied(frame.volume)));
}

Json BoxCostKey(ExperimentContext& context, const FrameCase& frame) { return ForBoxCosts(context, frame).key; }
Trial BoxCostTrial(ExperimentContext& context, const FrameCase& asked) {
  const KeyedFrame keyed = ForBoxCosts(context, asked);
  const auto run = [&context, frame = keyed.frame] { return MeasureBoxes(context, frame, PlanOf(context, frame)); };
  return keyed.MakeTrial(context, run, (1 + kRenderings) * ExpectedEffort(keyed.frame));
}

Json FinishKey(ExperimentContext& context, const FrameCase& frame) { return ForFinish(context, frame).key; }
Trial FinishTrial(ExperimentContext& context, const FrameCase& asked) {
  const KeyedFrame keyed = ForFinish(context, asked);
  return keyed.MakeTrial(
      context, [&context, frame = keyed.frame] { return MeasureFinish(context, frame); }, ExpectedEffort(keyed.frame));
}

Json ServiceKey(ExperimentContext& context, const FrameCase& frame, int frames) { return ForService(context, frame, frames).key; }
Trial ServiceTrial(ExperimentContext& context, const FrameCase& frame, int frames) {
  const auto run = [&context, frame, frames] { return MeasureService(context, frame, frames); };
  return ForService(context, frame, frames).MakeTrial(context, run, (2 + WarmUpFrames(frame.policy) + frames) * ExpectedEffort(frame));
}

Json ValidationKey(ExperimentContext& context, const FrameCase& frame, int turns) { return ForValidation(context, frame, turns).key; }
Trial ValidationTrial(ExperimentContext& context, const FrameCase& frame, int turns) {
  const auto run = [&context, frame, turns] { return MeasureValidation(context, frame, turns); };
  // The service's frames and the boxes, twice each.
  return ForValidation(context, frame, turns).MakeTrial(context, run, 4 * turns * ExpectedEffort(frame));
}

FrameInput MeasuredFrame::Input() const {
  FrameInput input{&plan, {}, finish_seconds, receive_seconds, picture_bytes};
  for (const Cost& box : boxes)
    input.boxes.push_back({box.seconds, box.coverage.share.empty() ? nullptr : &box.coverage, box.fetched_bytes});
  return input;
}

std::vector<double> MeasuredFrame::OfWorkers(double Cost::*number) const {
  std::vector<double> sums(plan.slots);
  for (const Placement& placement : PlacementsOf(plan)) sums[placement.worker - 1] += boxes[placement.id].*number;
  return sums;
}

double MeasuredFrame::RenderSeconds() const {
  double sum = 0;
  for (const Cost& box : boxes) sum += box.seconds;
  return sum;
}

double MeasuredFrame::StageSeconds(Stage stage) const {
  double sum = 0;
  for (const Cost& box : boxes) sum += box.stage_seconds[std::size_t(stage)];
  return sum;
}

MeasuredFrame Recall(ExperimentContext& context, const FrameCase& frame) {
  return WithBoxCosts(context, frame, PlanOf(context, frame), context.log().All(BoxCostKey(context, frame)));
}

std::vector<MeasuredFrame> RecallRepeats(ExperimentContext& context, const FrameCase& frame) {
  const FramePlan plan = PlanOf(context, frame);
  std::vector<MeasuredFrame> frames;
  for (const Json* repeat : context.log().All(BoxCostKey(context, frame))) frames.push_back(WithBoxCosts(context, frame, plan, {repeat}));
  return frames;
}

MeasuredFrame WithBoxCosts(ExperimentContext& context, const FrameCase& frame, FramePlan plan, const std::vector<const Json*>& repeats) {
  CHECK(!repeats.empty()) << BoxCostKey(context, frame).dump();
  const auto of_picture = [&](const char* number) { return EstimateOf(context.log(), FinishKey(context, frame), number).median; };
  MeasuredFrame measured{std::move(plan), {}, of_picture("finish_seconds"), of_picture("receive_seconds"), of_picture("picture_bytes")};
  measured.boxes.resize(measured.plan.layout->partition.boxes().size());

  const std::vector<double> ids = MediansOf(repeats, "ids"), seconds = MediansOf(repeats, "seconds"),
                            drawn = MediansOf(repeats, "drawn_voxels"), covered = MediansOf(repeats, "covered_pixels"),
                            bytes = MediansOf(repeats, "voxel_bytes");
  std::array<std::vector<double>, kStageCount> stages;
  for (int stage = 0; stage < kStageCount; ++stage) {
    stages[std::size_t(stage)] = MediansOf(repeats, "/stages/" + std::string(ToString(Stage(stage))));
  }
  for (std::size_t i = 0; i < ids.size(); ++i) {
    MeasuredFrame::Cost& box = measured.boxes.at(std::size_t(ids[i]));
    box = {.seconds = seconds[i],
           .drawn_voxels = drawn[i],
           .covered_pixels = covered[i],
           .voxel_bytes = bytes[i],
           .coverage = CoverageOf(repeats.front()->at("coverage")[i], FrameBounds(measured.plan.setup))};
    const auto work = repeats.front()->at("work")[i].get<std::vector<double>>();
    CHECK_EQ(work.size(), box.work.size());
    std::ranges::copy(work, box.work.begin());
    for (std::size_t stage = 0; stage < stages.size(); ++stage) box.stage_seconds[stage] = stages[stage][i];
  }
  return measured;
}

void FillImages(MeasuredFrame& frame) {
  const PixelBounds bounds = FrameBounds(frame.plan.setup);
  const CoverageMap full = UniformCoverage(bounds, double(bounds.pixel_count()), bounds.width(), bounds.height());
  for (MeasuredFrame::Cost& box : frame.boxes) {
    if (!box.coverage.share.empty()) box.coverage = full;
  }
}

Timeline Simulate(const MeasuredFrame& frame, const MachineModel& machine, int frames, int in_flight, bool keep_spans, int teams) {
  const Roster everybody = RosterOf(frame.plan.slots * std::uint32_t(teams));
  FramePlan plan = frame.plan;
  const bool in_shares = machine.picture.direct && SharesPay(WholeFrame(plan.setup).end, in_flight == 1);
  if (in_shares) plan.client.share_pixels = kSharePixels;
  std::vector<FramePlan> plans;  // the distinct plans
  for (std::size_t turn = 0; turn < std::min(std::size_t(frames), everybody.slots.size()); ++turn) {
    const Team team = TeamOf(everybody, std::uint32_t(teams), turn);
    plans.push_back(TakeTurn(plan, team.roster, team.turn));
  }
  std::vector<FrameInput> inputs(std::size_t(frames), frame.Input());
  for (std::size_t i = 0; i < inputs.size(); ++i) inputs[i].plan = &plans[i % plans.size()];
  return OrThrow(SimulateFrames(inputs, machine, {in_flight, keep_spans}));
}

double SteadySeconds(const MeasuredFrame& frame, const MachineModel& machine, int teams) {
  const std::size_t workers = std::size_t(frame.plan.slots) * std::size_t(teams);
  const int window = WindowFor(workers, std::uint32_t(teams), FrameBytes(frame.plan.setup)).frames;
  // Whole rounds of the teams, since teams may end together. The middle half is evaluated.
  const int frames = 4 * teams * std::max((window + teams - 1) / teams, 4);
  const Timeline timeline = Simulate(frame, machine, frames, std::min(window + 2, int(kMaxOpenRequests)), false, teams);
  std::vector<double> received;
  for (const SimulatedFrame& simulated : timeline.frames) received.push_back(simulated.received);
  std::sort(received.begin(), received.end());
  return (received[std::size_t(3 * frames / 4) - 1] - received[std::size_t(frames / 4) - 1]) / (frames * 0.5);
}

}  // namespace slabstream
