#include "laboratory/measure/lab_service.h"

#include <utility>

namespace slabstream {

Result<ServiceConnection> OpenLabService(int workers, const std::vector<std::shared_ptr<const Volume>>& volumes) {
  std::vector<DataSource> sources;
  for (const std::shared_ptr<const Volume>& volume : volumes) {
    sources.emplace_back([volume]() -> Result<std::shared_ptr<const Volume>> { return volume; });
  }
  return ServiceConnection::OpenLocal({.local_workers = workers, .local_threads = 1}, std::move(sources));
}

Result<TimedPicture> RenderTimed(Client& client, const FrameRequest& request) {
  const Time submitted = MonotonicNow();
  Result<Picture> picture = client.Render(request);
  if (!picture.ok()) return picture.status();
  return TimedPicture{submitted, MonotonicNow(), *std::move(picture)};
}

}  // namespace slabstream
