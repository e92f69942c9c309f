// Neuroglancer's precomputed volumes in folders as sources.
#pragma once

#include "data/sources/source_format.h"

namespace slabstream {

SourceFormat Precomputed();

}  // namespace slabstream
