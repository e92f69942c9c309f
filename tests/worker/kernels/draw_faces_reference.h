// The definition of DrawFaces in plain code. The same bits.
#pragma once

#include "worker/kernels/draw_faces.h"

namespace slabstream::testing {

std::size_t DrawFacesReference(Projection projection, const FaceProjection& faces, const FaceSite* sites, std::uint32_t first,
                               std::uint32_t count, const KeyBand& band);

}  // namespace slabstream::testing
