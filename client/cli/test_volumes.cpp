#include <fmt/format.h>

#include <iostream>
#include <string>

#include "client/cli/commands.h"
#include "common/files/files.h"
#include "data/volume_io/volume_writer.h"

namespace slabstream {
namespace {

Status Write(const Result<Volume>& made, const std::string& what, const std::string& output) {
  if (!made.ok()) return made.status();
  if (Status status = WriteVolume(*made, output); !status.ok()) return status;
  std::cout << fmt::format("wrote {}: {}, {} voxels a side, occupancy {:.4g}\n", output, what, made->description.geometry.size.x,
                           MeasureOccupancy(*made));
  return Status::Ok();
}

}  // namespace

Status RunSphere(const SphereOptions& options) {
  if (Status status = CheckCanWrite("--output", options.output); !status.ok()) return status;
  return Write(MakeSphere(options.request), fmt::format("class {}", int(options.request.sphere_class)), options.output);
}

Status RunClusters(const ClustersOptions& options) {
  if (Status status = CheckCanWrite("--output", options.output); !status.ok()) return status;
  return Write(MakeClusters(options.request), fmt::format("{} balls", options.request.balls), options.output);
}

}  // namespace slabstream
