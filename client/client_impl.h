// Client::Impl: the client's side of the client plane (docs/wire.md, section 7): which requests and questions are open, what to send, and
// what an answer means. One thread at a time.
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "client/client.h"
#include "client/direct_pictures.h"
#include "common/base/merged.h"
#include "common/transport/endpoint.h"
#include "common/wire/any_message.h"

namespace slabstream {

struct Client::Impl {
  // A request that has not ended.
  struct OpenRequest {
    SubmitFrame message;
    Time submitted, deadline;
    int resubmits = 0;
    bool cancelled = false;       // by the caller; the service has not answered yet
    bool awaits_picture = false;  // the service has done its part, and need not know it any more
  };

  // A question or an order that has no answer yet.
  struct OpenQuestion {
    Duration patience{};
    Time deadline;
    bool order = false;              // services answer those at once; a wakeup ends the wait for one
    std::size_t answer = 0;          // what answers it, as Event::What counts
    std::vector<std::byte> message;  // empty: it changes something, so it is not sent again
    int resubmits = 0;
  };

  using Order = std::variant<StatusQuery, ShutDown, KeysOrder, DataOrder, SteerDataset>;
  using OrderReply = std::variant<StatusReply, ShutDownReply, KeysReply, DataReply, SteerReply>;

  struct Event {
    using OfFrames = std::variant<FrameProgress, Picture, Status>;
    using What = Merged<OfFrames, QuestionReply, OrderReply>;
    using Asked = Merged<OfFrames, Question, Order>;  // each question and order stands where What has its answer
    RequestId request = 0;
    What what;
  };

  Impl(Context& client_context, const ServiceAddress& service, Socket service_socket, ClientTiming client_timing)
      : context(client_context),
        endpoint(service.endpoint),
        has_keys(service.keys.has_value()),
        takes_pictures(service.keys.has_value() && service.direct_pictures),
        socket(std::move(service_socket)),
        timing(client_timing) {}

  Status Send(MessageView message) { return socket.Send({}, Encode(message)); }

  void Submit(const SubmitFrame& message) { EndUnlessSent(message.request, Send(message)); }
  void EndUnlessSent(RequestId request, const Status& sent);

  // Sends due messages, waits for a message, a wakeup, a signal, the next due time or `limit`, and handles what has come. True: a wakeup or
  // a signal ended the wait.
  bool Pump(Time limit);

  Status NoAnswer(Duration timeout) const;

  // Sends a question or an order, of the number that is returned. It ends with its answer or a Status.
  template <class Message>
  RequestId Ask(Message message, Duration patience);
  // Waits for the end of what was submitted or asked. `Reply`: Picture, or the type of the answer.
  template <class Reply>
  Result<Reply> Await(RequestId id);
  void SendPing(Time now);
  bool Receive();  // true: something came
  void TellReceived();
  void Handle(CoordinatorToClient& message, const Bytes& payload);
  void Handle(FrameReply& reply, const Bytes& payload);
  void Handle(DirectPictures::Reply reply);
  void OpenDirectPictures();
  void MatchPictures();           // hands over the awaited ones that have come
  bool ExpirePictures(Time now);  // asks for those that are lost; true: there are some
  void Handle(const ClientPong& pong);
  void SubmitAgain(OpenRequest& lost);
  void AskAgain(RequestId nonce, OpenQuestion& lost);
  void End(RequestId request, Event::What end);  // nothing happens if it has ended
  bool ExpireQuestions(Time now);                // true: some have ended
  void FailAll(const Status& reason);

  // The reason, once the service counts as gone.
  std::optional<std::string> Loss(Time now) const;

  Context& context;
  std::string endpoint;
  const bool has_keys;
  const bool takes_pictures;  // straight from workers, if they reach this host
  Socket socket;
  ClientTiming timing;
  const bool same_process = ParseEndpoint(endpoint, false)->scheme == Scheme::kInproc;
  bool unreachable = false;  // the last ping could not be queued
  Status refusal;            // why whoever answers there is no service of this client; ok: it may be one
  Wakeup wakeup;
  std::uint64_t last_id = 0;                         // of requests and nonces
  std::uint64_t received_bytes = 0, told_bytes = 0;  // of payloads; those that the last ping told
  std::map<RequestId, OpenRequest> open;
  std::map<RequestId, OpenQuestion> questions;             // by nonce
  std::map<std::uint64_t, std::vector<RequestId>> pinged;  // requests and questions of each unanswered ping, by nonce
  std::unique_ptr<DirectPictures> direct;                  // from the first frame on; null: there is no such way
  bool direct_opened = false;                              // or tried
  std::deque<Event> events;
  Time next_ping;
  std::optional<Time> unanswered_since;  // time of the first ping since the last message
};

}  // namespace slabstream
