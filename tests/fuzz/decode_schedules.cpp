// Combining schemes as text, and the schedules that they stand for.
//
// input: u8 ranks, u8 root, text
#include <fmt/format.h>
#include <fmt/ranges.h>

#include "common/combining/named_schedule.h"
#include "common/combining/schemes.h"
#include "tests/fuzz/decoders.h"
#include "tests/support/check_schedule.h"
#include "tests/support/random_combining.h"

namespace slabstream {
namespace {

constexpr PixelRange kPixels = {0, 1000};
constexpr Rank kMostRanks = 33;

std::string TextOf(const CombiningChoice& choice) {
  std::vector<std::string> items;
  if (!choice.arguments.factors.empty()) items.push_back(fmt::format("{}", fmt::join(choice.arguments.factors, "x")));
  if (choice.arguments.strips > 0) items.push_back(fmt::format("strips={}", choice.arguments.strips));
  return fmt::format("{}{}{}", choice.scheme->name, items.empty() ? "" : ":", fmt::join(items, ","));
}

}  // namespace

bool DecodeSchedule(std::span<const std::byte> bytes) {
  FuzzInput input(bytes);
  const Rank ranks = 1 + input.Take<std::uint8_t>() % kMostRanks;
  std::vector<Rank> roots(1 + input.Take<std::uint8_t>() % 4);
  for (Rank& root : roots) root = input.Take<std::uint8_t>() % ranks;
  const std::string text(input.Text());
  const ScheduleName name{text, ranks, roots, {}};
  const Result<CombiningChoice> choice = ParseCombining(text);
  const Result<SharedSchedule> derived = DeriveSchedule(name, kPixels);
  CHECK_EQ(CheckScheduleName(name).ok(), choice.ok());
  CHECK_EQ(derived.ok(), choice.ok());
  if (!choice.ok()) return false;

  const Result<CombiningChoice> again = ParseCombining(TextOf(*choice));
  CHECK(again.ok()) << again.status().message();
  CHECK(again->scheme == choice->scheme && again->arguments == choice->arguments) << text;
  const Schedule schedule = choice->Make(ranks, roots, kPixels);
  CHECK(schedule == (*derived)->schedule()) << text;
  CHECK_LE(schedule.steps.size(), kMaxSteps);
  const Status sound = CheckSchedule(schedule, kPixels);
  CHECK(sound.ok()) << text << ": " << sound.message();
  return true;
}

std::vector<FuzzBytes> ScheduleSeeds() {
  Random random(43);
  std::vector<FuzzBytes> seeds;
  for (const CombiningEntry& scheme : CombiningSchemes()) {
    for (int i = 0; i < 4; ++i) {
      const std::string text = i == 0 ? std::string(scheme.name) : RandomArguments(scheme, random);
      FuzzSeed seed;
      seed.Put(std::uint8_t(random.Integer(0, 32))).Put(std::uint8_t(i));
      for (int root = 0; root <= i; ++root) seed.Put(std::uint8_t(random.Integer(0, 32)));
      seeds.push_back(seed.Put(text).bytes());
    }
  }
  return seeds;
}

}  // namespace slabstream
