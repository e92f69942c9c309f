#include "common/kernels/simd_target.h"

#include <hwy/highway.h>

#include <algorithm>
#include <cctype>
#include <cstdint>
#include <cstdlib>

namespace slabstream {
namespace {

std::string NameOf(std::int64_t target) {
  if (target == HWY_AVX3) return "avx512";  // Highway's name tells a generation
  std::string name = hwy::TargetName(target);
  std::ranges::transform(name, name.begin(), [](unsigned char c) { return char(std::tolower(c)); });
  return name;
}

// Those that are not to be used, as bits.
std::int64_t disabled = 0;

// Highway 1.0 forgets what is disabled when it lists the targets: kernels would use the best one from then on.
std::vector<std::int64_t> Targets() {
  std::vector<std::int64_t> targets = hwy::SupportedAndGeneratedTargets();
  if (disabled != 0) hwy::DisableTargets(disabled);
  return targets;
}

}  // namespace

std::vector<std::string> SimdTargets() {
  std::vector<std::string> names;
  for (const std::int64_t target : Targets()) names.push_back(NameOf(target));  // better ones have lower bits
  return names;
}

Status LimitSimdTargetByEnvironment() {
  disabled = 0;
  hwy::DisableTargets(disabled);
  if (Targets().empty()) {
    return Status::InvalidArgument(
        "compiled for " + NameOf(HWY_STATIC_TARGET) +
        " or better, which this processor does not have: on one of 2010 or later, deploy/build --portable serves");
  }
  const char* name = std::getenv("SLABSTREAM_SIMD");
  if (name == nullptr || *name == '\0') return Status::Ok();
  std::string known;
  for (const std::int64_t target : Targets()) {
    if (NameOf(target) == name) {
      disabled = target - 1;  // better ones have lower bits
      hwy::DisableTargets(disabled);
      return Status::Ok();
    }
    known += (known.empty() ? "" : ", ") + NameOf(target);
  }
  return Status::InvalidArgument("SLABSTREAM_SIMD: instruction set '" + std::string(name) + "' is not one of: " + known);
}

}  // namespace slabstream
