// Fields of a TIFF directory, for the files that use libtiff.
#pragma once

#include <tiffio.h>

namespace slabstream {

template <class T>
T Field(TIFF* tiff, ttag_t tag, T if_absent) {
  T value = if_absent;
  return TIFFGetFieldDefaulted(tiff, tag, &value) != 0 ? value : if_absent;
}

// Samples of so many bits lie across bytes, the highest bit first; each row begins with a byte.
constexpr bool IsPacked(unsigned bits) { return bits >= 1 && bits < 16 && bits != 8; }

}  // namespace slabstream
