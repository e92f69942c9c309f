#include <fmt/format.h>

#include <iostream>

#include "client/cli/commands.h"
#include "common/base/files.h"
#include "data/volume_io/volume_reader.h"

namespace slabstream {

Status RunSphere(const SphereOptions& options) {
  if (Status status = CheckCanWrite("--output", options.output); !status.ok()) return status;
  const Result<Volume> sphere = MakeSphere(options.request);
  if (!sphere.ok()) return sphere.status();
  if (Status status = WriteVolume(*sphere, options.output); !status.ok()) return status;
  std::cout << fmt::format("wrote {}: class {}, {} voxels a side, occupancy {:.4g}\n", options.output, int(options.request.sphere_class),
                           options.request.size, MeasureOccupancy(*sphere));
  return Status::Ok();
}

}  // namespace slabstream
