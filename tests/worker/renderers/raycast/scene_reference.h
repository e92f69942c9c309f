// Scenes in the ray caster's kernel and in its reference.
#pragma once

#include "tests/worker/renderers/render_support.h"

namespace slabstream::testing {

// The whole scene as one box, for each instruction set and gradient: without leaps, and by the renderer with them. Its labels, if it has
// any, must reach the volume.
void ExpectAgreesWithReference(Scene scene, float tolerance);

}  // namespace slabstream::testing
