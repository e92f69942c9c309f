// What files call units of length.
#pragma once

#include <optional>
#include <string_view>

#include "common/volume/orientation.h"

namespace slabstream {

// "mm", "microns", "Nanometers", in upper or lower case; none: a name that is not known.
std::optional<LengthUnit> LengthUnitNamed(std::string_view name);

// Micrometres in any length of the metric system, and in inches, feet, yards, miles, points and others that OME knows;
// none: a name that is not known.
std::optional<double> MicrometresIn(std::string_view name);

// The name that is written, in ASCII: "um". `unit` is one that files state.
std::string_view FileNameOf(LengthUnit unit);

// How long it is; `unit` is one that files state.
double MetresIn(LengthUnit unit);

}  // namespace slabstream
