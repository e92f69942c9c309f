// Session: a client connected to a service, or to an embedded one of its own (`--local`).
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "client/cli/options.h"
#include "client/client.h"
#include "common/base/status.h"
#include "common/layers/layer_reader.h"
#include "coordinator/data_source.h"

namespace slabstream {

class EmbeddedService;

class Session {
 public:
  // At the service `source` is a name of its catalogue. With local workers it is a volume file: Open checks that it exists, and the first
  // frame reads it. Unavailable within 5 s if nobody answers.
  // `layers`: files, with local workers only; else InvalidArgument.
  static Result<Session> Open(const ConnectionOptions& connection, const std::string& source, const LayerFiles& layers = {});
  // In this process, by connection.local_workers > 0. A function in `source` supplies the volume when the first frame needs it, on a thread
  // of its own.
  static Result<Session> OpenLocal(const ConnectionOptions& connection, DataSource source);
  // The service alone, for `status`.
  static Result<Session> OpenService(const ServiceChoice& choice);
  static Result<Session> OpenService(const ServiceAddress& service);
  Session(Session&&) noexcept;
  Session& operator=(Session&&) = delete;
  ~Session();

  Client& client() { return *client_; }
  const std::string& dataset() const { return dataset_; }  // the dataset to request

 private:
  Session();
  // Destroyed last to first: the client leaves, the service ends, the context closes.
  std::unique_ptr<Context> context_;
  std::unique_ptr<EmbeddedService> service_;
  std::unique_ptr<Client> client_;
  std::string dataset_;
};

}  // namespace slabstream
