// What a simulated world is made of, by chance: a volume or grid with empty parts, how fast and how large workers are, one policy for all
// frames; and the frames that clients ask for in it.
#pragma once

#include <cstdint>
#include <memory>

#include "common/frame/frame_request.h"
#include "common/volume/occupancy_grid.h"
#include "common/volume/summary.h"
#include "common/wire/client_messages.h"
#include "tests/simulator/faults.h"
#include "tests/simulator/model_cells.h"
#include "tests/simulator/model_worker.h"
#include "tests/support/random.h"

namespace slabstream {

struct SimulatedWorld {
  std::shared_ptr<const VolumeSummary> summary;
  std::shared_ptr<const OccupancyGrid> occupied;
  bool in_parts = false;  // nobody holds the volume
  bool owned = false;     // processes own it (ModelOwners)
  bool shapes = false;    // pictures show a shape, too
  WorkerConfig worker_config;
  WorkerSpeed speed;
  Policy policy;
};

// `cells`: whether the volume is a grid's. `owned`: it lies with owners.
SimulatedWorld RandomWorld(Random& random, const Faults& faults, const ModelCells& cells, bool owned);

// A request for the world's volume, "volume".
SubmitFrame RandomRequest(Random& random, const Policy& policy, RequestId id, std::uint32_t deadline_ms);

}  // namespace slabstream
