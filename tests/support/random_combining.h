// Combining schemes for tests: every entry of the list, by name and with arguments drawn at random.
#pragma once

#include <string>

#include "common/combining/schemes.h"
#include "tests/support/random.h"

namespace slabstream {

// As --combine takes it.
inline std::string RandomArguments(const CombiningEntry& scheme, Random& random) {
  std::string text(scheme.name);
  char separator = ':';
  const auto add = [&](const std::string& item) {
    text.append(1, separator).append(item);
    separator = ',';
  };
  if (scheme.most_factors > 0 && random.Chance(0.8)) {
    std::string factors = std::to_string(random.Integer(2, 6));
    const auto count = random.Integer<std::size_t>(1, std::min<std::size_t>(scheme.most_factors, 4));
    for (std::size_t i = 1; i < count; ++i) factors.append(1, 'x').append(std::to_string(random.Integer(2, 6)));
    add(factors);
  }
  if (scheme.takes_strips && random.Chance(0.8)) add(std::string("strips=").append(std::to_string(random.Integer(1, 9))));
  return text;
}

inline std::string RandomCombining(Random& random) {
  return RandomArguments(CombiningSchemes()[random.Integer<std::size_t>(0, CombiningSchemes().size() - 1)], random);
}

inline Schedule MakeSchedule(const std::string& combining, const ScheduleRequest& request) {
  return ParseCombining(combining)->Make(request);
}

}  // namespace slabstream
