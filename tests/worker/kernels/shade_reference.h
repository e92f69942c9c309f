// The definition of ShadeOctets in plain code.
#pragma once

#include <span>

#include "worker/kernels/shade.h"

namespace slabstream {

void ShadeOctetsReference(const ShadeTables& tables, float slope_step, std::span<const OctetWork> octets);

}  // namespace slabstream
