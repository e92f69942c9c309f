// N5 containers in folders as sources.
#pragma once

#include "data/sources/source_format.h"

namespace slabstream {

SourceFormat N5();

}  // namespace slabstream
