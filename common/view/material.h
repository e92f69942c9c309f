// Material: how much of the light on its surfaces matter sends to the viewer (Phong 1975; common/view/phong.h).
#pragma once

namespace slabstream {

struct Material {
  // Ambient and diffuse add up to 1: a surface that faces a single light has exactly the colour of its transfer function.
  float ambient = 0.2F, diffuse = 0.8F, specular = 0.2F;  // [0, 1]
  float shininess = 20;                                   // [1, 1000]
  friend bool operator==(const Material&, const Material&) = default;
};

}  // namespace slabstream
