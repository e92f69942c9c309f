// A picture by the embedded service with one worker of one thread.
#pragma once

#include "client/client.h"
#include "laboratory/experiments/experiment.h"

namespace slabstream {

Picture RenderAlone(ExperimentContext& context, const BenchCase& volume, const ViewParameters& view, int pixels);

}  // namespace slabstream
