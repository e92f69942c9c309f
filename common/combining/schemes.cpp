#include "common/combining/schemes.h"

#include <algorithm>

namespace slabstream {
namespace {

std::uint32_t OrElse(std::uint32_t value, std::uint32_t otherwise) { return value == 0 ? otherwise : value; }

std::vector<std::uint32_t> FactorsOf(const ScheduleRequest& request, const CombiningArguments& arguments) {
  return arguments.factors.empty() ? DefaultFactors(request.ranks) : arguments.factors;
}

}  // namespace

const std::vector<CombiningEntry>& CombiningSchemes() {
  using Request = ScheduleRequest;
  using Arguments = CombiningArguments;
  static const std::vector<CombiningEntry> entries = {
      {"fan-in", "binary tree of workers, log2(workers) rounds", "", 0, false,
       [](const Request& request, const Arguments&) { return MakeFanIn(request); }},
      {"centralized", "all workers send to one, which combines all images", "", 0, false,
       [](const Request& request, const Arguments&) { return MakeCentralized(request); }},
      {"chain", "from neighbour to neighbour, in strips (default: one per worker, at most 64)", "strips=S", 0, true,
       [](const Request& request, const Arguments& arguments) {
         return MakeChain(request, OrElse(arguments.strips, std::clamp<std::uint32_t>(request.ranks, 1, 64)));
       }},
      {"tree", "K (default 4) workers meet at one, in strips (default 1)", "K,strips=S", 1, true,
       [](const Request& request, const Arguments& arguments) {
         return MakeTree(request, arguments.factors.empty() ? 4 : arguments.factors[0], OrElse(arguments.strips, 1));
       }},
      {"radix-k", "groups of K1, K2, ... workers divide the picture among them, round by round", "K1xK2x...", kMaxFactors, false,
       [](const Request& request, const Arguments& arguments) { return MakeSwap(request, FactorsOf(request, arguments)); },
       [](const Request& request, const Arguments& arguments) { return MakeSwapTree(request, FactorsOf(request, arguments)); }},
      {"binary-swap", "pairs of workers halve the picture, round by round", "", 0, false,
       [](const Request& request, const Arguments&) { return MakeSwap(request, std::vector<std::uint32_t>(16, 2)); },
       [](const Request& request, const Arguments&) { return MakeSwapTree(request, std::vector<std::uint32_t>(16, 2)); }},
      {"direct-send", "every worker combines one share of the picture", "", 0, false,
       [](const Request& request, const Arguments&) { return MakeSwap(request, std::vector<std::uint32_t>{request.ranks}); },
       [](const Request& request, const Arguments&) { return MakeSwapTree(request, std::vector<std::uint32_t>{request.ranks}); }},
  };
  return entries;
}

Schedule CombiningChoice::Make(Rank ranks, const std::vector<Rank>& roots, PixelRange pixels, std::uint32_t most_steps) const {
  if (roots.size() == 1) return Make({ranks, roots.front(), pixels, most_steps});
  const auto make = scheme->make_share != nullptr ? scheme->make_share : scheme->make;
  Schedule whole = {ranks, roots, {}};
  for (std::size_t share = 0; share < roots.size(); ++share) {
    const PixelRange of_root = Share(pixels, share, roots.size());
    if (of_root.begin == of_root.end) continue;
    const Schedule steps = make({ranks, roots[share], of_root, most_steps / std::uint32_t(roots.size())}, arguments);
    whole.steps.insert(whole.steps.end(), steps.steps.begin(), steps.steps.end());
  }
  std::ranges::stable_sort(whole.steps, {}, &Step::round);
  return whole;
}

}  // namespace slabstream
