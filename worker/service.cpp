#include "worker/service.h"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <map>
#include <optional>
#include <random>
#include <set>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <variant>
#include <vector>

#include "common/base/guarded.h"
#include "common/base/limited_log.h"
#include "common/base/log.h"
#include "common/base/pooled_vector.h"
#include "common/base/shared_arena.h"
#include "common/transport/authenticator.h"
#include "common/transport/endpoint.h"
#include "common/transport/mailbox.h"
#include "worker/executor.h"
#include "worker/images_endpoint.h"
#include "worker/known_peers.h"
#include "worker/peer_sockets.h"

namespace slabstream {
namespace {

constexpr Duration kLongestWait = std::chrono::seconds(1);       // between checks for idle connections
constexpr Duration kLookRound = std::chrono::milliseconds(100);  // between looks at what became of connections
constexpr Duration kStopGrace = std::chrono::seconds(5);         // for the machine to leave in an orderly way
constexpr std::size_t kMostRefused = 4096;                       // images that wait for an endpoint
constexpr int kReceiveBatch = 64;                                // messages of one socket before the other sockets' turn

Incarnation RandomIncarnation() {
  std::random_device device;
  const Incarnation incarnation = (Incarnation{device()} << 32) | device();
  return incarnation == 0 ? 1 : incarnation;
}

// The worker that sent a message of the images plane.
WorkerId SenderOf(const MessageToWorker& message) {
  if (const auto* partial = std::get_if<PartialImage>(&message)) return partial->from_worker;
  if (const auto* refused = std::get_if<ImageRefused>(&message)) return refused->from_worker;
  const auto* received = std::get_if<ImageReceived>(&message);
  return received == nullptr ? 0 : received->from_worker;
}

std::string HostName() {
  std::array<char, 256> name{};
  if (::gethostname(name.data(), name.size() - 1) != 0 || name[0] == '\0') return "localhost";
  return name.data();
}

// Of the images plane: this worker's own, as it registered them.
struct ImagesKeys {
  KeyPair own;
  std::string plane;
};

constexpr Duration kPeerPatience = std::chrono::seconds(3);  // less than a handshake may take

}  // namespace

struct WorkerService::Impl {
  Impl(Context& service_context, WorkerOptions worker_options, std::optional<ImagesKeys> images_keys, Socket control_socket,
       Socket images_socket, ImagesEndpoint endpoint_of_images)
      : context(service_context),
        options(std::move(worker_options)),
        keys(std::move(images_keys)),
        machine(options.machine),
        control(std::move(control_socket)),
        images(std::move(images_socket)),
        images_endpoint(std::move(endpoint_of_images)),
        peers(service_context, keys ? std::optional(keys->own) : std::nullopt),
        others(keys ? &service_context.authenticator() : nullptr, keys ? keys->plane : ""),
        executor(std::in_place, outbox, options.compression == Compression::kOn ? Codec::kZstd : Codec::kRaw, int(options.machine.threads),
                 options.make_renderer, options.task_hook) {}

  void Run();
  Status Loop();  // not ok: why the worker leaves though nobody told it to
  template <class Messages>
  void Receive(Socket& socket, Plane plane);
  // False: the key of the connection is not that of the worker whom the message names.
  bool ComesFromItsSender(const Incoming& incoming, const MessageToWorker& message) const;
  void HandleEvent(WorkerEvent event);
  void HandleOutput(ExecutorOutput& output);
  void SetRegistered();
  void LookAtConnections();
  void Remember(const MessageToWorker& message);
  bool OpenShared(const MessageToWorker& message);
  void Refuse(const PartialImage& partial);
  void Acknowledge(const MessageToWorker& message, std::size_t payload_bytes);
  bool Answer(WorkerId sender, MessageView message);
  // Workers with the same scope are on this host; 0: unknown.
  bool OnThisHost(const Peer& peer) const { return options.machine.memory_scope != 0 && peer.memory_scope == options.machine.memory_scope; }
  bool IsTimed(const Peer& peer) const;
  Delivery DeliveryTo(const Peer& peer) const;

  // One for each kind of action.
  void Perform(SendControl& action);
  void Perform(SendChunkRequest& action);
  void Perform(ConnectSlabs& action);
  void Perform(SendPartial& action);
  void Perform(StopProcess& action);
  template <class Action>
  void Perform(Action& action) {
    executor->Perform(std::move(action));
  }
  void Send(Socket& socket, MessageView message);

  Context& context;
  const WorkerOptions options;
  const std::optional<ImagesKeys> keys;
  WorkerMachine machine;
  Socket control, images;
  ImagesEndpoint images_endpoint;
  const std::string first_images_endpoint = images_endpoint.text();
  std::optional<Socket> slabs;  // once the coordinator has named its endpoint
  std::string slabs_endpoint;
  PeerSockets peers;
  Epoch epoch = 0;
  LinkRates links;                       // while compression is automatic
  KnownPeers others;                     // of this registration
  std::set<WorkerId> takes_frames_only;  // workers that cannot map memory though they have the same scope
  std::vector<PartialImage> to_refuse;   // from workers whose endpoint is not known yet
  std::atomic<bool> registered = false;  // at least once, or stopped
  std::atomic<bool> leave_requested = false, stop_requested = false;
  std::atomic<bool> stopped = false;
  Status ended;                    // set before `stopped`
  bool stop_now = false;           // set by the machine
  LimitedLog complaints;           // about messages
  Mailbox<ExecutorOutput> outbox;  // its wakeup also signals stop_requested
  std::optional<Executor> executor;
  std::jthread thread;  // owns the sockets and the machine; last member: ends first
};

void WorkerService::Impl::Run() {
  ended = Guarded("worker", [&] { return Loop(); });
  if (!ended.ok()) {
    LogError("the worker leaves: " + ended.message());
    (void)Guarded("worker", [&] {
      HandleEvent(StopRequested{});
      return Status::Ok();
    });
  }
  executor.reset();
  SetRegistered();
  stopped = true;
  stopped.notify_all();
}

Status WorkerService::Impl::Loop() {
  Time stop_deadline = Time::max();
  Time next_look = Time::min();
  bool leaving = false;
  HandleEvent(Tick{});
  while (!stop_now && MonotonicNow() < stop_deadline) {
    std::vector<Socket*> sockets = {&control, &images};
    if (slabs) sockets.push_back(&*slabs);
    Wait(sockets, &outbox.wakeup(), std::clamp(machine.NextWake() - MonotonicNow(), Duration::zero(), kLongestWait));
    if (executor->broken()) throw std::runtime_error("a task could not report its failure");
    for (ExecutorOutput& output : outbox.TakeAll()) HandleOutput(output);
    Receive<CoordinatorToWorker>(control, Plane::kControl);
    Receive<WorkerToWorker>(images, Plane::kImages);
    if (slabs) Receive<SlabsToWorker>(*slabs, Plane::kSlabs);
    const Time now = MonotonicNow();
    if (machine.NextWake() <= now) HandleEvent(Tick{});
    if (now >= next_look) {
      LookAtConnections();
      next_look = now + kLookRound;
    }
    if (leave_requested && !leaving) {
      leaving = true;
      LogInfo("is leaving: finishes what it has");
      HandleEvent(LeaveRequested{});
    }
    if (stop_requested && stop_deadline == Time::max()) {
      stop_deadline = now + kStopGrace;
      HandleEvent(StopRequested{});
    }
    peers.CloseIdle(now);
    executor->peer_memory().CloseIdle(now);
    if (control.refused()) {
      return Status::Unavailable("the coordinator at " + options.coordinator_endpoint + " refuses the key: it was revoked or is another's");
    }
  }
  return Status::Ok();
}

void WorkerService::Impl::LookAtConnections() {
  for (const WorkerId peer : peers.TakeBroken()) HandleEvent(PeerUnreachable{peer});
  if (auto endpoint = images_endpoint.Follow(images, control.local_host())) HandleEvent(Moved{*std::move(endpoint)});
}

// Only what belongs to the plane is heard: everybody may send to the images plane, the coordinator alone to the others.
template <class Messages>
void WorkerService::Impl::Receive(Socket& socket, Plane plane) {
  for (int i = 0; i < kReceiveBatch; ++i) {
    std::optional<Incoming> incoming = socket.TryReceive();
    if (!incoming) return;
    Bytes payload = incoming->payload();
    Result<Messages> decoded = Guarded("decoding", [&] { return Decode<Messages>(incoming->header(), payload.size()); });
    if (!decoded.ok()) {
      complaints.Warning(std::string(NameOf(plane)) + " plane: dropped a message: " + decoded.status().message());
      continue;
    }
    MessageToWorker message = Widen<MessageToWorker>(*std::move(decoded));
    if (!ComesFromItsSender(*incoming, message)) {
      complaints.Warning(std::string(NameOf(plane)) + " plane: dropped a message of another worker than it says");
      continue;
    }
    Remember(message);
    Acknowledge(message, payload.size());
    if (OpenShared(message)) HandleEvent(MessageReceived{std::move(message), std::move(payload)});
  }
}

bool WorkerService::Impl::ComesFromItsSender(const Incoming& incoming, const MessageToWorker& message) const {
  if (incoming.user.empty()) return true;
  const Peer* const sender = others.Find(SenderOf(message));
  return sender == nullptr || sender->images_key == incoming.user;
}

// Handles memory shared between workers, and the links between them: the machine knows nothing of either.
void WorkerService::Impl::Remember(const MessageToWorker& message) {
  if (const auto* welcome = std::get_if<Welcome>(&message)) {
    if (welcome->epoch != epoch || welcome->worker != machine.worker()) {
      LogInfo("registered as worker " + std::to_string(welcome->worker) + " at " + options.coordinator_endpoint);
      others.ForgetAll();
    }
    if (std::exchange(epoch, welcome->epoch) == welcome->epoch) return;
    executor->Forget([](const GroupKey&) { return true; });
    takes_frames_only.clear();
    links.ForgetAll();
  } else if (const auto* ping = std::get_if<Ping>(&message); ping != nullptr && ping->epoch == epoch) {
    executor->Forget([&](const GroupKey& key) {
      return key.frame < ping->finished_before || std::ranges::find(ping->cancelled, key.frame) != ping->cancelled.end();
    });
    others.Gone(ping->gone, images);
  } else if (const auto* assignment = std::get_if<GroupAssignment>(&message); assignment != nullptr && assignment->epoch == epoch) {
    const GroupKey& now = assignment->key;
    executor->Forget([&](const GroupKey& key) {
      const bool read = key.frame == now.frame && (key.attempt < now.attempt || key.group < assignment->groups_done);
      return read || key.frame < assignment->finished_before;
    });
    for (const Peer& peer : assignment->peers) others.Name(peer);
    for (const PartialImage& refused : std::exchange(to_refuse, {})) Refuse(refused);
  } else if (const auto* received = std::get_if<ImageReceived>(&message); received != nullptr && received->epoch == epoch) {
    links.Received(received->from_worker, received->number, MonotonicNow());
  }
}

void WorkerService::Impl::Acknowledge(const MessageToWorker& message, std::size_t payload_bytes) {
  const auto* partial = std::get_if<PartialImage>(&message);
  if (partial == nullptr || partial->acknowledge == 0 || payload_bytes < kLeastAcknowledgedBytes || partial->epoch != epoch) return;
  Answer(partial->from_worker, ImageReceived{epoch, machine.worker(), partial->acknowledge});  // without it, the sender asks again
}

// False: the sender is not known yet.
bool WorkerService::Impl::Answer(WorkerId sender, MessageView message) {
  const Peer* const peer = others.Find(sender);
  if (peer == nullptr) return false;
  const Status sent = peers.Send(*peer, Encode(message), {}, MonotonicNow());
  if (!sent.ok()) LogWarning("worker " + std::to_string(sender) + " is not reached: " + sent.message());
  return true;
}

// True if the message is for the machine. A shared image is, only if it can be read here.
bool WorkerService::Impl::OpenShared(const MessageToWorker& message) {
  if (const auto* refused = std::get_if<ImageRefused>(&message)) {
    if (refused->epoch == epoch && takes_frames_only.insert(refused->from_worker).second) {
      LogWarning("worker " + std::to_string(refused->from_worker) + " cannot read this worker's memory: its images travel in frames");
    }
    if (refused->epoch == epoch) executor->Resend(*refused);
    return false;
  }
  const auto* partial = std::get_if<PartialImage>(&message);
  if (partial == nullptr || !partial->shared) return true;
  const Status opened = executor->peer_memory().Open(partial->shared->arena, MonotonicNow()).status();
  if (opened.ok()) return true;
  if (epoch != 0 && partial->epoch != epoch) return false;  // 0: it may have overtaken the first Welcome
  LogInfo("an image of worker " + std::to_string(partial->from_worker) + " is asked for in frames: " + opened.message());
  Refuse(*partial);
  return false;
}

void WorkerService::Impl::Refuse(const PartialImage& partial) {
  if (Answer(partial.from_worker, ImageRefused{partial.epoch, machine.worker(), partial.key, partial.step, partial.pixels})) return;
  // The group's assignment with the endpoint has not arrived yet.
  if (to_refuse.size() < kMostRefused) to_refuse.push_back(partial);
}

void WorkerService::Impl::HandleEvent(WorkerEvent event) {
  const bool was_registered = machine.registered();
  for (WorkerAction& action : machine.Step(std::move(event), MonotonicNow())) {
    std::visit([this](auto& each) { Perform(each); }, action);
  }
  if (was_registered && !machine.registered() && !stop_now) LogInfo("has lost its coordinator, and registers again");
  if (machine.registered()) SetRegistered();
}

void WorkerService::Impl::SetRegistered() {
  if (!registered.exchange(true)) registered.notify_all();
}

void WorkerService::Impl::HandleOutput(ExecutorOutput& output) {
  if (auto* event = std::get_if<WorkerEvent>(&output)) {
    HandleEvent(std::move(*event));
  } else if (auto* frame = std::get_if<OutgoingFrame>(&output)) {
    const Status sent = Guarded("send", [&] {
      if (options.task_hook) options.task_hook("send");
      return control.Send({}, std::move(frame->header), frame->payload);
    });
    if (!sent.ok()) HandleEvent(SendFailed{frame->key, sent});
  } else {
    auto& partial = std::get<OutgoingPartial>(output);
    if (IsTimed(partial.to)) links.Sent(partial.to.worker, partial.acknowledge, partial.payload.size(), MonotonicNow());
    Status sent;
    const Status tried = Guarded("send", [&] {
      if (options.task_hook) options.task_hook("send");
      sent = peers.Send(partial.to, std::move(partial.header), partial.payload, MonotonicNow());
    });
    if (!tried.ok()) return HandleEvent(SendFailed{partial.key, tried});  // no fault of the peer's
    if (sent.ok()) return;
    LogWarning("worker " + std::to_string(partial.to.worker) + " is not reached: " + sent.message());
    HandleEvent(PeerUnreachable{partial.to.worker});
  }
}

// Lost messages are not sent again here: registration, heartbeats and requests repeat.
void WorkerService::Impl::Send(Socket& socket, MessageView message) {
  if (const Status sent = socket.Send({}, Encode(message)); !sent.ok())
    LogDebug(std::string(NameOf(message)) + " not sent: " + sent.message());
}

void WorkerService::Impl::Perform(SendControl& action) {
  if (auto* done = std::get_if<GroupDone>(&action.message)) executor->AddSent(done->key, done->reports);
  Send(control, action.message);
}

void WorkerService::Impl::Perform(StopProcess& action) {
  LogInfo("ends after rendering " + std::to_string(action.rendered_ranks) + " boxes");
  stop_now = true;
}

void WorkerService::Impl::Perform(SendChunkRequest& action) {
  if (slabs) Send(*slabs, action.request);
}

void WorkerService::Impl::Perform(ConnectSlabs& action) {
  if (slabs && action.endpoint == slabs_endpoint) return;  // the socket reconnects by itself
  slabs.reset();
  Result<Socket> socket = Socket::Dealer(context, {.client_keys = options.keys});
  const Status connected = socket.ok() ? socket->Connect(action.endpoint) : socket.status();
  if (!connected.ok()) {
    LogError("slabs plane: " + connected.message());  // chunk requests time out and are reported
    return;
  }
  slabs = std::move(*socket);
  slabs_endpoint = action.endpoint;
}

Delivery WorkerService::Impl::DeliveryTo(const Peer& peer) const {
  if (options.machine.lends_memory && OnThisHost(peer) && takes_frames_only.count(peer.worker) == 0) return {.lend = true};
  if (options.compression == Compression::kOn) return {.bytes_per_second = 0};
  return IsTimed(peer) ? Delivery{.bytes_per_second = links.Of(peer.worker)} : Delivery{};
}

// Links within a host are not timed: a lack of processor time would look like a slow link, and packing would worsen it.
bool WorkerService::Impl::IsTimed(const Peer& peer) const {
  return options.compression == Compression::kAuto && !OnThisHost(peer) && peer.images_endpoint.starts_with("tcp://");
}

void WorkerService::Impl::Perform(SendPartial& action) {
  const Delivery delivery = DeliveryTo(*action.to);
  if (IsTimed(*action.to)) action.message.acknowledge = links.Ask(action.to->worker, MonotonicNow());
  executor->Perform(std::move(action), delivery);
}

Result<std::unique_ptr<WorkerService>> WorkerService::Start(Context& context, WorkerOptions options) {
  const Result<Endpoint> coordinator = ParseEndpoint(options.coordinator_endpoint, false);
  if (!coordinator.ok()) return coordinator.status();
  WorkerConfig& config = options.machine;
  if (config.threads < 1 || config.threads > kMaxThreads) {
    return Status::InvalidArgument("threads " + std::to_string(config.threads) + " is out of range [1, " + std::to_string(kMaxThreads) +
                                   "]");
  }
  config.incarnation = RandomIncarnation();

  std::optional<ImagesKeys> keys;
  SocketOptions images_options;
  if (options.keys) {
    keys = ImagesKeys{MakeKeyPair(), "images-" + std::to_string(config.incarnation)};
    images_options.server_keys = ServerKeys{.secret_key = keys->own.secret_key, .plane = keys->plane, .sealed = true};
    config.images_key = keys->own.public_key;
    context.authenticator().SetPatience(keys->plane, kPeerPatience);
  }
  Result<Socket> images = Socket::Router(context, images_options);
  if (!images.ok()) return images.status();
  Result<ImagesEndpoint> images_endpoint = ImagesEndpoint::Bind(*images, options.images_endpoint, *coordinator, config.incarnation);
  if (!images_endpoint.ok()) return images_endpoint.status();
  Result<Socket> control = Socket::Dealer(context, {.client_keys = options.keys});
  if (!control.ok()) return control.status();
  if (Status connected = control->Connect(options.coordinator_endpoint); !connected.ok()) return connected;

  config.pid = static_cast<std::uint32_t>(::getpid());
  config.host = HostName();
  config.images_endpoint = images_endpoint->text();
  config.memory_scope = SharedMemoryScope();
  if (options.share_memory) {
    if (const Status shared = ShareBlocks(); !shared.ok()) {
      LogWarning(shared.message() + ": images travel in frames");
      options.share_memory = false;
    }
  }
  config.lends_memory = options.share_memory;
  auto impl = std::make_unique<Impl>(context, std::move(options), std::move(keys), std::move(*control), std::move(*images),
                                     std::move(*images_endpoint));
  impl->thread = std::jthread([raw = impl.get()] { raw->Run(); });
  return std::unique_ptr<WorkerService>(new WorkerService(std::move(impl)));
}

WorkerService::WorkerService(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
WorkerService::~WorkerService() { RequestStop(); }

const std::string& WorkerService::images_endpoint() const { return impl_->first_images_endpoint; }

void WorkerService::RequestLeave() {
  if (impl_->leave_requested.exchange(true)) impl_->stop_requested = true;
  impl_->outbox.wakeup().Notify();
}

void WorkerService::RequestStop() {
  impl_->stop_requested = true;
  impl_->outbox.wakeup().Notify();
}

void WorkerService::WaitUntilRegistered() { impl_->registered.wait(false); }
void WorkerService::WaitUntilStopped() { impl_->stopped.wait(false); }
bool WorkerService::stopped() const { return impl_->stopped; }
Status WorkerService::ended() const { return impl_->stopped ? impl_->ended : Status::Ok(); }

}  // namespace slabstream
