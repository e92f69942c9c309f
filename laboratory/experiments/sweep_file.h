// The file of `experiment sweep`: the parameters to vary, as JSON. docs/experiments.md has an example.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "common/base/status.h"
#include "common/frame/frame_request.h"
#include "common/simulation/link_model.h"
#include "laboratory/bench/bench_cases.h"
#include "laboratory/experiments/frame_case.h"

namespace slabstream {

inline constexpr std::size_t kMaxSweepBytes = std::size_t{1} << 20;
inline constexpr int kMaxSweepWorkers = 4096;
inline constexpr std::size_t kMaxSweepCases = 10000;

struct SweepRenderer {
  std::string name;
  const RendererKind* kind = FindRenderer(kDefaultRenderer);
  Look look = {};
};
struct SweepPolicy {
  std::string name;
  Policy policy;
};
struct SweepView {
  std::string name;
  ViewParameters view;
};
struct SweepLink {
  std::string name;
  LinkModel link;
};

// Every combination of these is a case.
struct Sweep {
  std::string title;
  std::vector<BenchCase> volumes;
  std::vector<SweepRenderer> renderers;
  std::vector<SweepView> views;
  std::vector<SweepPolicy> policies;
  std::vector<int> workers;
  std::vector<SweepLink> links;
  ImageSize size{512, 512};
};

// The name of a policy that was given none.
std::string Describe(const Policy& policy);

// InvalidArgument in one line naming `path`, the field by its place ("policies[1].combine"), the value and what is allowed.
Result<Sweep> ParseSweep(const std::string& path, std::string_view text);
// The same of a file; also fails if it cannot be read.
Result<Sweep> ReadSweep(const std::string& path);

}  // namespace slabstream
