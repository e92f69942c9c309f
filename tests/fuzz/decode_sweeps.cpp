// Files of `experiment sweep`.
#include <set>

#include "common/planning/resolved_policy.h"
#include "common/wire/validate_request.h"
#include "laboratory/experiments/sweep_file.h"
#include "tests/fuzz/decoders.h"

namespace slabstream {
namespace {

template <class Entries>
void CheckNamesDiffer(const Entries& entries) {
  std::set<std::string> names;
  for (const auto& entry : entries) CHECK(names.insert(entry.name).second) << entry.name;
}

}  // namespace

bool DecodeSweep(std::span<const std::byte> bytes) {
  const Result<Sweep> sweep = ParseSweep("sweep.json", FuzzInput(bytes).Text());
  if (!sweep.ok()) {
    CheckRefusal(sweep.status());
    return false;
  }
  CheckNamesDiffer(sweep->volumes);
  CheckNamesDiffer(sweep->renderers);
  CheckNamesDiffer(sweep->views);
  CheckNamesDiffer(sweep->policies);
  CheckNamesDiffer(sweep->links);
  const std::size_t cases = sweep->volumes.size() * sweep->renderers.size() * sweep->views.size() * sweep->policies.size() *
                            sweep->workers.size() * sweep->links.size();
  CHECK(cases >= 1 && cases <= kMaxSweepCases) << cases;
  // Whatever a sweep names can be asked for.
  for (const NamedPolicy& policy : sweep->policies) CHECK(CheckNames(policy.policy).ok()) << policy.name;
  for (const SweepRenderer& renderer : sweep->renderers) {
    FrameRequest request;
    request.dataset = "volume";
    request.renderer = renderer.kind->name();
    request.parameters = renderer.look.parameters;
    request.size = sweep->size;
    request.view = sweep->views.front().view;
    request.policy = sweep->policies.front().policy;
    const Status valid = Validate(request);
    CHECK(valid.ok()) << valid.message();
  }
  return true;
}

std::vector<FuzzBytes> SweepSeeds() {
  return {SeedOf(R"({
  "title": "two", "size": [300, 200],
  "volumes": [{"sphere": {"class": 2, "size": 40, "occupancy": 0.3}, "opacity": 0.2}, {"sphere": {}, "transfer": "opaque", "opacity_distance": 2}],
  "renderers": ["splat", {"name": "fine", "renderer": "raycast", "sampling-rate": 2, "shading": "none", "light": [[1, 0, 0.5]], "termination": 0}],
  "views": [{"azimuth": 30}, {"name": "close", "projection": "perspective", "zoom": 2, "fov": 40, "roll": 3, "elevation": -4}],
  "policies": [{"combine": "fan-in"}, {"name": "even", "decomposition": "kd-tree", "balance_by": "occupied", "assignment": "greedy", "groups": 2,
    "combine": "tree:4,strips=8", "balance": "dynamic", "pixel_error": 0.001, "axis": "x", "teams": 2}],
  "workers": [1, 16],
  "links": ["10gbit", "1gbit:30,1"]
})"),
          SeedOf(R"({"volumes": [{"sphere": {}}], "workers": [2], "size": 64,
    "policies": [{"groups": "auto"}]})")};
}

}  // namespace slabstream
