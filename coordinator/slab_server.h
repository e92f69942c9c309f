// SlabServer: the coordinator's end of the slabs plane. Its own thread owns the ROUTER and answers chunk requests out of the loaded
// volumes.
//
// It keeps no state about workers: each request is the credit for one answer of at most kChunkBytes. A request that cannot be met is
// refused with a reason. Chunks go out packed, but raw over inproc, where they then are the volume's own memory.
#pragma once

#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "common/base/status.h"
#include "common/transport/socket.h"
#include "common/volume/volume.h"
#include "common/wire/any_message.h"

namespace slabstream {

class SlabServer {
 public:
  static Result<std::unique_ptr<SlabServer>> Start(Context& context, const std::string& endpoint, Epoch epoch);
  ~SlabServer();  // stops and joins

  const std::string& endpoint() const { return endpoint_; }

  // From any thread; once an id. The volume is served until the server ends.
  void Publish(DatasetId dataset, std::shared_ptr<const Volume> volume);

 private:
  SlabServer(Socket socket, std::string endpoint, Epoch epoch);
  void Run(const std::stop_token& stop);
  void Answer(const Incoming& incoming);
  std::shared_ptr<const Volume> Find(DatasetId dataset);

  const std::string endpoint_;
  const Epoch epoch_;
  const Codec codec_;
  std::mutex mutex_;
  std::map<DatasetId, std::shared_ptr<const Volume>> volumes_;  // guarded by mutex_
  Wakeup wakeup_;
  Socket socket_;        // the thread's
  std::jthread thread_;  // last member
};

}  // namespace slabstream
