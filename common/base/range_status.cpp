#include "common/base/range_status.h"

#include <fmt/format.h>

namespace slabstream {

Status InRange(std::string_view field, double value, double min, double max) {
  if (value >= min && value <= max) return Status::Ok();
  return Status::InvalidArgument(fmt::format("{} is {}, but must lie in [{}, {}]", field, value, min, max));
}

}  // namespace slabstream
