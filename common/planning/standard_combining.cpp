#include "common/planning/standard_combining.h"

namespace slabstream {

std::string_view StandardCombining(std::size_t workers, std::int64_t pixels) {
  // Trees send the fewest messages, but the last of them carry whole pictures. If that takes long, every worker should combine a share: in
  // one round, or if so many messages would take long, in few.
  constexpr std::size_t kSeveral = 8, kMany = 64;
  constexpr std::int64_t kManyPixels = std::int64_t{1} << 20;
  if (workers >= kMany) return "radix-k";
  return workers >= kSeveral && pixels >= kManyPixels ? "direct-send" : "fan-in";
}

}  // namespace slabstream
