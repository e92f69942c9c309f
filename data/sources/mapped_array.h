// An array whose elements are data values of float32, made of those of another array that stand for them: scaled slice by slice, and NaN
// where an element stands for no value.
#pragma once

#include <cstddef>
#include <limits>
#include <memory>
#include <vector>

#include "common/volume/volume.h"
#include "data/sources/chunked_array.h"

namespace slabstream {

// What elements stand for.
struct ElementMeaning {
  // One for all elements, or one for each index along the first `mapped_axes` axes, the last of which varies fastest.
  std::vector<ValueMapping> mappings = {ValueMapping{}};
  std::size_t mapped_axes = 0;
  // Elements outside are taken for the nearest limit, or stand for no value.
  double least = -std::numeric_limits<double>::infinity(), most = std::numeric_limits<double>::infinity();
  bool clamp = false;
  std::vector<double> missing = {};  // elements that stand for no value

  // One mapping with a scale above 0 says it all, so that no MappedArray is needed.
  bool linear() const;
};

// `meaning.mappings` has as many as the array has indices there. Of an array of float32, limits and missing elements are rounded to that.
std::shared_ptr<ChunkedArray> MakeMappedArray(std::shared_ptr<ChunkedArray> array, ElementMeaning meaning);

}  // namespace slabstream
