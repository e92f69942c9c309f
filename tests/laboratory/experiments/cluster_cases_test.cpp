// Cases that were measured on a time-dilated cluster (bench/record_cluster_cases): the simulation of each is made anew from the recorded
// costs of its boxes, and must stay as near to what was measured as docs/simulation.md says.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "common/files/files.h"
#include "laboratory/experiments/figures.h"
#include "tests/support/temporary_directory.h"

namespace slabstream {
namespace {

// Of docs/simulation.md, "Errors against the cluster".
constexpr double kMeanError = 0.22, kMostError = 0.5;

Json ReadCases() {
  const std::string path = std::string(SLABSTREAM_SOURCE_DIRECTORY) + "/tests/laboratory/experiments/cluster_cases.json";
  return Json::Parse(ReadTextFile(path, std::size_t{1} << 24).value()).value();
}

FrameCase FrameOf(const Json& recorded) {
  const Json& sphere = recorded["sphere"];
  const SphereRequest request{SphereClass(sphere["class"].get<int>()), sphere["size"].get<int>(), sphere["occupancy"].get<double>()};
  const auto pixels = recorded["pixels"].get<std::int32_t>();
  const RendererKind* const renderer = FindRenderer(recorded["renderer"].get<std::string>());
  FrameCase frame{SphereCase(request, sphere["opacity"].get<double>(), renderer),
                  {pixels, pixels},
                  BenchView(Projection::kOrthographic, 1, 12),
                  {.decomposition = recorded["decomposition"].text(), .balance_by = recorded["balance_by"].text(), .groups = 1},
                  recorded["workers"].get<int>()};
  frame.policy.combine = "fan-in";
  return frame;
}

TEST(ClusterCases, AreSimulatedAsNearAsTheDocumentSays) {
  const Json all = ReadCases();
  const TemporaryDirectory folder;
  TrialLog log = OrThrow(TrialLog::Open(folder / "run", {"test", Json::object(), "", ""}, Resume::kSame));
  ExperimentContext keys({}, OrThrow(TrialLog::Open(folder / "keys", {"test", Json::object(), "", ""}, Resume::kSame)), {});
  ASSERT_TRUE(log.Append(HostTrial().key, 0, all["host"]).ok());
  for (const Json& recorded : all["cases"]) {
    ASSERT_TRUE(log.Append(BoxCostKey(keys, FrameOf(recorded)), 0, recorded["boxes"]).ok());
    const Json picture = FinishKey(keys, FrameOf(recorded));
    if (log.All(picture).empty()) {
      ASSERT_TRUE(log.Append(picture, 0, recorded["picture"]).ok());
    }
  }
  ExperimentContext context({}, std::move(log), {});
  std::vector<double> errors;
  for (const Json& recorded : all["cases"]) {
    const FrameCase frame = FrameOf(recorded);
    const LinkModel link = ParseLink("link", recorded["link"].get<std::string>()).value();
    const FrameFigures figures = RecallFigures(context, frame, link, 1, {.cores = 1, .encrypted = true, .direct_pictures = false}).front();
    const auto check = [&](const char* what, double seconds) {
      errors.push_back(std::abs(seconds / recorded[what].get<double>() - 1));
      EXPECT_LE(errors.back(), kMostError) << what << " of " << recorded["renderer"] << ", " << recorded["decomposition"]
                                           << ", p = " << recorded["workers"] << ": " << seconds << " s, measured " << recorded[what];
    };
    check("latency", figures.latency_seconds);
    check("period", figures.steady_seconds);
  }
  ASSERT_GE(errors.size(), 20U);
  double sum = 0;
  for (const double error : errors) sum += error;
  EXPECT_LE(sum / double(errors.size()), kMeanError);
}

}  // namespace
}  // namespace slabstream
