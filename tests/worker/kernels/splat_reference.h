// The definition of FilterBeam and CompositeRow in plain code.
#pragma once

#include "worker/kernels/splat.h"

namespace slabstream {

void FilterBeamReference(const FootprintTable& footprint, const Lattice& lattice, const BeamWork& work);
void CompositeRowReference(const RowWork& work);

}  // namespace slabstream
