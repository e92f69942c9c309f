// Data values as text, with every digit that they have.
#pragma once

#include <string>

namespace slabstream {

// Whole numbers in full up to 2^64; of others the shortest text that reads back the same: as a float, if the value is one.
std::string ValueText(double value);

}  // namespace slabstream
