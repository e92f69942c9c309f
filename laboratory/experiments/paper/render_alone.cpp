#include "laboratory/experiments/paper/render_alone.h"

#include "client/cli/service_connection.h"

namespace slabstream {

Picture RenderAlone(ExperimentContext& context, const BenchCase& volume, const ViewParameters& view, int pixels) {
  const VolumeInUse held = context.volumes().Get(volume);
  ServiceConnection connection = OrThrow(ServiceConnection::OpenLocal(
      {.local_workers = 1, .local_threads = 1}, {[voxels = held.volume]() -> Result<std::shared_ptr<const Volume>> { return voxels; }}));
  FrameRequest request = BenchRequest(volume, view, {pixels, pixels});
  request.dataset = connection.dataset();
  return OrThrow(connection.client().Render(request));
}

}  // namespace slabstream
