// The combining schemes by name, as --combine and Policy.combine spell them: NAME, or NAME:ARGUMENTS for those that take any.
//
//   arguments = item { "," item }      item = factors | "strips=" number      factors = number { "x" number }
//
// for example "tree:4,strips=8" and "radix-k:4x4". Arguments that are left out are chosen by the scheme.
#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

#include "common/base/status.h"
#include "common/combining/schedule.h"

namespace slabstream {

inline constexpr std::uint32_t kMaxFactor = 1024, kMaxStrips = 256;
inline constexpr std::size_t kMaxFactors = 16;

struct CombiningArguments {
  std::vector<std::uint32_t> factors;  // each in [2, kMaxFactor]; empty: the scheme chooses
  std::uint32_t strips = 0;            // [1, kMaxStrips]; 0: the scheme chooses
  friend bool operator==(const CombiningArguments&, const CombiningArguments&) = default;
};

struct CombiningEntry {
  std::string_view name;
  std::string_view purpose;      // one line for --help
  std::string_view arguments;    // what may follow "NAME:", for --help and errors; empty: nothing may
  std::size_t most_factors = 0;  // most factors that it takes
  bool takes_strips = false;
  // Any arguments that the entry takes.
  Schedule (*make)(const ScheduleRequest&, const CombiningArguments&);
  // One share of several, which have a root each. Null: as `make`, since the scheme does not divide the picture by itself.
  Schedule (*make_share)(const ScheduleRequest&, const CombiningArguments&);

  bool divides() const { return make_share != nullptr; }
};

// The only list.
const std::vector<CombiningEntry>& CombiningSchemes();

// A scheme and its arguments.
struct CombiningChoice {
  const CombiningEntry* scheme = nullptr;
  CombiningArguments arguments;
  Schedule Make(const ScheduleRequest& request) const { return scheme->make(request, arguments); }
  // Each of `roots` gets its share of the pixels. At most `most_steps` / roots.size() ranks.
  Schedule Make(Rank ranks, const std::vector<Rank>& roots, PixelRange pixels, std::uint32_t most_steps = kMaxSteps) const;
};

// InvalidArgument: an unknown name (the message lists the known ones), or arguments that the scheme does not take, with their limits.
Result<CombiningChoice> ParseCombining(std::string_view text);

}  // namespace slabstream
