// A small file of each format and variant of shapes, written byte by byte from the formats' definitions.
#pragma once

#include <algorithm>
#include <initializer_list>
#include <string>
#include <vector>

#include "common/shapes/shape.h"

namespace slabstream {

struct ShapeSample {
  std::string name;  // of the file, each another one
  std::string bytes;
};

std::vector<ShapeSample> ShapeSamples();
std::string BytesOfShapeSample(const std::string& name);

// What of a shape's description (common/shapes/shape.h) does not hold; "": all of it does.
std::string WhatIsWrong(const Shape& shape);

// Numbers as bytes, in either order.
template <class T>
std::string NumberBytes(std::initializer_list<T> numbers, bool big_endian = false) {
  std::string bytes;
  for (const T number : numbers) {
    std::string each(reinterpret_cast<const char*>(&number), sizeof number);
    if (big_endian) std::reverse(each.begin(), each.end());
    bytes += each;
  }
  return bytes;
}

// A binary glTF file of a JSON text and the bytes behind it.
std::string GlbFile(std::string json, std::string binary);

}  // namespace slabstream
