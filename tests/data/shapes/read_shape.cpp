// Reads files of shapes for tests by other programs' files: read_shape FILE OUTPUT.
//
// The arrays go to OUTPUT.positions (float64, of the world), .normals, .values, .radii (float32), .colors (uint8), .triangles, .lines
// (uint32); one line of JSON says the kind, or the error.
#include <fstream>
#include <iostream>
#include <span>
#include <string>

#include "common/json/json.h"
#include "data/shapes/shape_file.h"

int main(int, char** arguments) {
  using namespace slabstream;
  const Result<Shape> shape = ReadShape(arguments[1]);
  if (!shape.ok()) {
    std::cout << Json{{"error", shape.status().message()}}.dump() << std::endl;
    return 0;
  }
  const auto write = [&](const char* name, const auto& array) {
    std::ofstream file(arguments[2] + std::string(name), std::ios::binary);
    const auto bytes = std::as_bytes(std::span(array));
    file.write(reinterpret_cast<const char*>(bytes.data()), std::streamsize(bytes.size()));
  };
  std::vector<Vec3> positions;
  for (const auto& [x, y, z] : shape->positions) positions.push_back(shape->origin + Vec3{x, y, z});
  write(".positions", positions);
  write(".normals", shape->normals);
  write(".colors", shape->colors);
  write(".values", shape->values);
  write(".radii", shape->radii);
  write(".triangles", shape->triangles);
  write(".lines", shape->line_begins);
  std::cout << Json{{"kind", NameOf(shape->kind)}}.dump() << std::endl;
}
