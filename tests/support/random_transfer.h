// Random transfer functions for tests: up to 8 points a curve over [0, 100], with steps, flat and fully clear stretches.
#pragma once

#include <algorithm>

#include "common/classification/transfer_function.h"
#include "tests/support/random.h"

namespace slabstream {

inline TransferFunction RandomTransfer(Random& random) {
  const auto ascending_values = [&] {
    std::vector<double> values(std::size_t(random.Integer(1, 8)));
    for (double& value : values) value = random.Chance(0.3) ? random.Integer(0, 10) * 10 : random.Real(0, 100);
    std::sort(values.begin(), values.end());
    return values;
  };
  TransferFunction transfer;
  for (const double value : ascending_values()) {
    transfer.colors.push_back({value, {float(random.Real(0, 1)), float(random.Real(0, 1)), float(random.Real(0, 1))}});
  }
  for (const double value : ascending_values()) {
    const double sharpness = random.Chance(0.3) ? 0 : random.Chance(0.2) ? 1 : random.Real(0, 1);
    transfer.opacities.push_back({value, random.Chance(0.4) ? 0 : random.Real(0, 1), random.Real(0.01, 0.99), sharpness});
  }
  transfer.opacity_distance = random.Real(0.5, 4);
  const auto share = [&] { return float(random.Real(0, 1)); };
  if (random.Chance(0.5)) transfer.material = Material{share(), share(), share(), float(random.Real(1, 1000))};
  return transfer;
}

}  // namespace slabstream
