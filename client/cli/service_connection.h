// ServiceConnection: a client connected to a service, or to an embedded one of its own (`--local`).
#pragma once

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "client/cli/options.h"
#include "client/client.h"
#include "common/base/status.h"
#include "data/catalogue/data_source.h"
#include "data/layers/layer_files.h"

namespace slabstream {

class EmbeddedService;

// Whether SOURCE may be a dataset of the service, before the service is asked. NotFound: it is the path of a file that does not exist, or
// no service runs here. InvalidArgument: it is a file's path, or too long for a name. Unavailable: no service runs here.
Status CheckDataset(const ServiceChoice& choice, const std::string& source);

class ServiceConnection {
 public:
  // For volumes `sources`, at least one. At the service they are names of its catalogue. With local workers they are volume files: Open
  // checks that they exist, and the first frame of each reads it. Unavailable within 5 s if nobody answers. Errors of CheckDataset.
  // `layers`: files that belong to each of them, with local workers only; else InvalidArgument.
  // `shapes`: of requests: with local workers files, which become datasets of these names.
  static Result<ServiceConnection> Open(const ConnectionOptions& connection, std::span<const std::string> sources,
                                        const LayerFiles& layers = {}, std::span<const ShapeChoice> shapes = {});
  static Result<ServiceConnection> Open(const ConnectionOptions& connection, const std::string& source, const LayerFiles& layers = {}) {
    return Open(connection, {&source, 1}, layers);
  }
  // In this process, by connection.local_workers > 0. A function in a source supplies its volume when the first frame needs it, on a thread
  // of its own.
  static Result<ServiceConnection> OpenLocal(const ConnectionOptions& connection, std::vector<DataSource> sources,
                                             std::span<const ShapeChoice> shapes = {});
  // The service alone. It may be about to start: Unavailable after 4 s, but at once if none is named and none runs here. OpenRunning, for
  // `status` and `down`, waits for no start: it is Unavailable at once if nobody listens at an address of this machine.
  static Result<ServiceConnection> OpenService(const ServiceChoice& choice);
  static Result<ServiceConnection> OpenService(const ServiceAddress& service);
  static Result<ServiceConnection> OpenRunning(const ServiceAddress& service);
  ServiceConnection(ServiceConnection&&) noexcept;
  ServiceConnection& operator=(ServiceConnection&&) = delete;
  ~ServiceConnection();

  Client& client() { return *client_; }
  // The dataset to request for the source of this number.
  const std::string& dataset(std::size_t source = 0) const { return datasets_[source]; }

 private:
  ServiceConnection();
  // Destroyed last to first: the client leaves, the service ends, the context closes.
  std::unique_ptr<Context> context_;
  std::unique_ptr<EmbeddedService> service_;
  std::unique_ptr<Client> client_;
  std::vector<std::string> datasets_;
};

}  // namespace slabstream
