// The file of `experiment sweep`: the parameters to vary, as JSON. docs/experiments.md has an example.
//
// A sweep runs on this machine or at a running service. The service has workers, links and volumes of its own: a volume is then a dataset
// of its catalogue (a sphere is the dataset of its name: class2-512), and the file names neither workers, links nor hosts.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "common/base/status.h"
#include "common/frame/frame_request.h"
#include "laboratory/bench/bench_cases.h"
#include "laboratory/experiments/frame_case.h"
#include "laboratory/experiments/machines.h"
#include "laboratory/experiments/policies.h"
#include "simulator/model/link_model.h"

namespace slabstream {

inline constexpr std::size_t kMaxSweepBytes = std::size_t{1} << 20;
inline constexpr int kMaxSweepWorkers = 4096;
inline constexpr std::size_t kMaxSweepCases = 10000;

struct SweepRenderer {
  std::string name;
  const RendererKind* kind = &DefaultRenderer();
  FrameRequest look = {};  // as FrameCase has it
};
struct SweepView {
  std::string name;
  ViewParameters view;
};
struct SweepLink {
  std::string name;
  LinkModel link;
};

enum class SweepPlace : bool { kHere, kAtService };

// Every combination of these is a case. At a service `workers` and `links` are empty, and `host` has its defaults.
struct Sweep {
  std::string title;
  std::vector<BenchCase> volumes;
  std::vector<SweepRenderer> renderers;
  std::vector<SweepView> views;
  std::vector<NamedPolicy> policies;
  std::vector<int> workers;
  std::vector<SweepLink> links;
  HostModel host;  // the host that is simulated
  ImageSize size{512, 512};
};

// The name of a policy that was given none.
std::string Describe(const Policy& policy);

// InvalidArgument in one line naming `path`, the field by its place ("policies[1].combine"), the value and what is allowed.
Result<Sweep> ParseSweep(const std::string& path, std::string_view text, SweepPlace place = SweepPlace::kHere);
// The same of a file; also fails if it cannot be read.
Result<Sweep> ReadSweep(const std::string& path, SweepPlace place = SweepPlace::kHere);

// A combination of volume, renderer, view and policy.
struct SweepFrame {
  FrameCase frame;  // the frame for one worker
  Json names;       // what the file calls them, as columns of results: part, volume, view, variant
};
std::vector<SweepFrame> FramesOf(const Sweep& sweep);

}  // namespace slabstream
