// The gradients of a mesh's values, by which its matter is lit.
#pragma once

#include "common/math/vec.h"
#include "common/memory/aligned_buffer.h"
#include "common/mesh/mesh.h"

namespace slabstream {

// For each point, the mean of the gradients of its tetrahedra, weighted by their volumes: along the axes of the space that the points lie
// in, and as a share of the longest gradient of a point (only directions matter for light). Values of tetrahedra count as those of their
// points, where they have the mean of the tetrahedra weighted by volume. Tetrahedra with a value that is not finite have no gradient; a
// point of no other has the gradient 0. `mesh`: with a value for each point or tetrahedron. Any thread.
AlignedVector<Vector3<float>> PointGradients(const Mesh& mesh);

}  // namespace slabstream
