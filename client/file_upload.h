// FileUpload: a file that is sent to a service and is a dataset there as long as this object lives. It is a client of its own, on a thread
// of its own.
#pragma once

#include <cstdint>
#include <functional>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "client/client.h"
#include "common/base/status.h"
#include "common/memory/bytes.h"
#include "common/wire/client_messages.h"

namespace slabstream {

class FileUpload {
 public:
  // Both are called on the upload's thread, and must not destroy it.
  struct Events {
    std::function<void(std::uint64_t bytes)> sent;  // so many from the beginning are on their way to the service
    // Ok: the dataset is there. Afterwards, and instead of it: why there is none, once. Errors: the service's; Unavailable: it is gone.
    std::function<void(Status status)> changed;
  };

  // `context` and what the events use must outlive it. `name`: of the dataset.
  FileUpload(Context& context, const ServiceAddress& service, std::string name, SentFile file, Events events);
  ~FileUpload();  // removes the dataset, and waits for at most half a second
  FileUpload(const FileUpload&) = delete;
  FileUpload& operator=(const FileUpload&) = delete;

  // Any thread. The next bytes, at most as many as the file still has.
  void Add(Bytes bytes);

 private:
  void Run(Context& context, const ServiceAddress& service);
  // Until the upload is stopped, or it has failed.
  Status Serve(Socket& socket);
  Status SendParts(Socket& socket);
  Result<bool> Receive(Socket& socket);  // true: something came

  const AddVolume order_;
  const Events events_;
  // Used by the upload's thread alone.
  std::uint64_t allowed_ = 0, sent_ = 0;
  std::uint64_t pings_ = 0;
  // Shared.
  std::mutex mutex_;
  std::vector<Bytes> added_;
  bool stopping_ = false;
  Wakeup wakeup_;
  std::thread thread_;
};

}  // namespace slabstream
