// LabService: an embedded service with some volumes, and a client that times its frames.
#pragma once

#include <map>
#include <memory>
#include <string>

#include "client/client.h"
#include "client/embedded/embedded_service.h"
#include "common/base/status.h"
#include "common/volume/volume.h"

namespace slabstream {

struct TimedPicture {
  Time submitted, received;  // at the client, on the clock of the spans
  Picture picture;
};

class LabService {
 public:
  // `workers` of one render thread each. Fails with the service.
  static Result<std::unique_ptr<LabService>> Start(int workers, const std::map<std::string, std::shared_ptr<const Volume>>& volumes);

  // One frame at a time; request.dataset is one of the volumes' names. Fails with the frame.
  Result<TimedPicture> Render(const FrameRequest& request);

 private:
  LabService() = default;

  Context context_;
  std::unique_ptr<EmbeddedService> service_;
  std::optional<Client> client_;
};

}  // namespace slabstream
