// Client: asks a service for pictures. The library behind the command line; also what tests and other programs use.
//
//   auto client = Client::Connect(context, "tcp://127.0.0.1:7420");        // Unavailable if nobody answers within 4 s
//   RequestId id = client->Submit(request);
//   while (true) { auto event = client->Next(1s); ... }                     // progress, previews, the picture, or the failure
// One thread at a time.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "common/base/status.h"
#include "common/image/picture_image.h"
#include "common/transport/socket.h"
#include "common/wire/client_messages.h"

namespace slabstream {

struct Picture {
  ImageSize size;
  PictureGeometry geometry;
  PictureKey key;      // empty unless the request asked for it
  PictureImage image;  // its bounds lie within `size`
  bool final = true;
  std::uint32_t groups_done = 1, group_count = 1;
  FrameStatistics statistics;  // final only
  Duration latency{};          // request to last byte, measured here; final only
  bool direct = false;         // all of it came straight from workers, nothing through the coordinator
};

struct ClientEvent {
  RequestId request = 0;
  std::variant<FrameProgress, Picture, QuestionReply, StatusReply, SteerReply, Status> what;  // Status: the request failed
};

// Where a service is.
struct ServiceAddress {
  // NOLINTNEXTLINE(google-explicit-constructor): an endpoint is an address
  ServiceAddress(std::string at, std::optional<ClientKeys> with = std::nullopt) : endpoint(std::move(at)), keys(std::move(with)) {}
  ServiceAddress(const char* at) : endpoint(at) {}  // NOLINT(google-explicit-constructor)

  std::string endpoint;
  std::optional<ClientKeys> keys;  // the keys of a client or an admin; none: the service has no keys
  bool direct_pictures = true;     // with keys, workers that can reach this host send it pictures; else all come through the coordinator
};

struct ClientTiming {
  Duration ping = std::chrono::seconds(1);  // between pings while requests are open
  // If a ping has had no answer for this long, the service counts as gone. A service in the same process (inproc) cannot be lost, only be
  // slow: it counts as gone when it has ended.
  Duration silence = std::chrono::seconds(5);
  // If the service says that a worker has sent a picture, and it does not come for this long, and 1 s longer a MB, it is asked for again,
  // this time through the coordinator.
  Duration lost_picture = std::chrono::seconds(5);
};

inline constexpr Duration kAnswerTime = std::chrono::minutes(2);  // for an answer to a question: volumes may have to be loaded first

class Client {
 public:
  // Unavailable also if the service refuses the key, or soon after `give_up`, which may be empty, returns true.
  static Result<Client> Connect(Context& context, const ServiceAddress& service, Duration timeout = std::chrono::seconds(4),
                                ClientTiming timing = {}, const std::function<bool()>& give_up = {});
  Client(Client&&) noexcept;
  Client& operator=(Client&&) noexcept;
  ~Client();  // cancels open requests

  // A deadline counts from the request's arrival at the service and is limited to what the schema allows.
  RequestId Submit(const FrameRequest& request, Duration deadline = std::chrono::minutes(10));
  // A question about what a dataset holds; its nonce is filled in. It ends with a QuestionReply or a Status. If its dataset is not loaded,
  // it is loaded first.
  RequestId Submit(Question question, Duration deadline = kAnswerTime);
  RequestId Submit(StatusQuery question, Duration timeout);  // about the service; ends with a StatusReply or a Status
  RequestId Submit(SteerDataset order, Duration timeout);    // ends with a SteerReply or a Status
  void Cancel(RequestId request);                            // cancels a question, too: nothing more is heard of it

  // The next event of any open request; nullopt after the timeout, or earlier if wakeup() was notified or a signal was handled. If the
  // service stops answering, every open request gets an Unavailable event. A request that the service has lost, because it was started
  // anew, is submitted again, a few times and within its deadline, unless it was cancelled.
  std::optional<ClientEvent> Next(Duration timeout);

  // Submits and waits for the end.
  Result<Picture> Render(const FrameRequest& request, Duration deadline = std::chrono::minutes(10));

  // The answers to questions; these submit and wait. InvalidArgument, NotFound, ...: as of frames.
  Result<SummaryReply> Summarize(SummaryQuery query, Duration deadline = kAnswerTime);
  Result<std::vector<VolumeSample>> SampleAt(SampleQuery query, Duration deadline = kAnswerTime);
  Result<ViewReply> ChooseView(ViewQuery query, Duration deadline = kAnswerTime);
  Result<StatisticsReply> StatisticsIn(StatisticsQuery query, Duration deadline = kAnswerTime);

  // A notified wakeup() ends this one early: Unavailable.
  Result<StatusReply> QueryStatus(Duration timeout = std::chrono::seconds(5));
  // InvalidArgument: the service has keys, and this client's is not an admin's.
  Status ShutDownService(Duration timeout = std::chrono::seconds(5));
  // For admins; `order.nonce` is filled in. The keys that are admitted then. InvalidArgument, NotFound: the service refuses, with its
  // reason.
  Result<std::vector<AdmittedKey>> OrderKeys(KeysOrder order, Duration timeout = std::chrono::seconds(5));

  // About the datasets of the catalogue; `order.nonce` is filled in. The datasets after it. Errors: as OrderKeys; ResourceExhausted: the
  // catalogue is full.
  Result<std::vector<DatasetStatus>> OrderData(DataOrder order, Duration timeout = std::chrono::seconds(30));

  // About the simulation that holds a dataset; `order.nonce` is filled in. NotFound, InvalidArgument: the service refuses, with its reason.
  Result<SimulationStatus> Steer(SteerDataset order, Duration timeout = std::chrono::seconds(5));

  Wakeup& wakeup();  // Notify ends a Next early, from any thread or a signal handler

 private:
  struct Impl;
  explicit Client(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace slabstream
