#include "laboratory/measure/lab_service.h"

#include <utility>

namespace slabstream {

Result<std::unique_ptr<LabService>> LabService::Start(int workers, const std::map<std::string, std::shared_ptr<const Volume>>& volumes) {
  std::unique_ptr<LabService> lab(new LabService());
  EmbeddedOptions options;
  options.workers = workers;
  for (const auto& [name, volume] : volumes) {
    options.coordinator.catalogue[name] = [volume = volume]() -> Result<std::shared_ptr<const Volume>> { return volume; };
  }
  Result<std::unique_ptr<EmbeddedService>> service = EmbeddedService::Start(lab->context_, std::move(options));
  if (!service.ok()) return service.status();
  lab->service_ = *std::move(service);
  Result<Client> client = lab->service_->Connect();
  if (!client.ok()) return client.status();
  lab->client_ = *std::move(client);
  return lab;
}

Result<TimedPicture> LabService::Render(const FrameRequest& request) {
  const Time submitted = MonotonicNow();
  Result<Picture> picture = client_->Render(request);
  if (!picture.ok()) return picture.status();
  return TimedPicture{submitted, MonotonicNow(), *std::move(picture)};
}

}  // namespace slabstream
