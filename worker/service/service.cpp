#include "worker/service/service.h"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <random>
#include <span>
#include <stdexcept>
#include <thread>
#include <utility>
#include <variant>
#include <vector>

#include "common/base/limited_log.h"
#include "common/base/log.h"
#include "common/memory/pooled_vector.h"
#include "common/memory/shared_arena.h"
#include "common/threads/guarded.h"
#include "common/transport/authenticator.h"
#include "common/transport/endpoint.h"
#include "common/transport/mailbox.h"
#include "common/wire/other_version.h"
#include "worker/service/images_endpoint.h"
#include "worker/service/peer_sockets.h"
#include "worker/service/picture_sockets.h"
#include "worker/service/stored_voxels.h"
#include "worker/service/worker_metrics.h"

namespace slabstream {
namespace {

constexpr Duration kLongestWait = std::chrono::seconds(1);       // between checks for idle connections
constexpr Duration kLookRound = std::chrono::milliseconds(100);  // between looks at what became of connections
constexpr Duration kStopGrace = std::chrono::seconds(5);         // for the machine to leave in an orderly way
constexpr int kReceiveBatch = 64;                                // messages of one socket before the other sockets' turn

Incarnation RandomIncarnation() {
  std::random_device device;
  const Incarnation incarnation = (Incarnation{device()} << 32) | device();
  return incarnation == 0 ? 1 : incarnation;
}

// The worker that sent a message of the images plane.
WorkerId SenderOf(const MessageToWorker& message) {
  return std::visit(
      [](const auto& each) -> WorkerId {
        if constexpr (requires { each.from_worker; }) return each.from_worker;
        return 0;
      },
      message);
}

// What a coordinator says to a worker that has come to the endpoint for clients.
std::optional<Status> RefusalIn(std::span<const std::byte> header) {
  const Result<CoordinatorToClient> message = Decode<CoordinatorToClient>(header);
  const auto* const refused = message.ok() ? std::get_if<OrderRefused>(&*message) : nullptr;
  return refused == nullptr ? std::nullopt : std::optional(refused->status);
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

// What pictures that clients do not take may take of a worker's memory. `memory_bytes` 0: no limit was given.
std::uint64_t UnsentShare(std::uint64_t memory_bytes) { return memory_bytes == 0 ? std::uint64_t{256} << 20 : memory_bytes / 16; }

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
        pictures(service_context, keys ? std::optional(keys->own) : std::nullopt, UnsentShare(options.machine.memory_bytes)),
        executor(std::in_place, outbox, options.machine.compression == LinkCompression::kOn ? Codec::kZstd : Codec::kRaw,
                 int(options.machine.threads), options.make_renderer, options.task_hook) {}

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

  // One for each kind of action.
  void Perform(SendControl& action);
  void Perform(SendChunkRequest& action);
  bool ReadsHeld(const SendChunkRequest& action);  // whether this process holds the voxels, so that none need to come
  void Perform(ConnectVoxels& action);
  void Perform(ResendImage& action);
  void Perform(AnswerPeer& action);
  void Perform(AdmitKeys& action);
  void Perform(StopProcess& action);
  template <class Action>
  void Perform(Action& action) {
    executor->Perform(std::move(action));
  }
  void Send(Socket& socket, MessageView message);
  Status Send(OutgoingFrame& frame);  // its payload straight to the client, if there is a way

  Context& context;
  const WorkerOptions options;
  const std::optional<ImagesKeys> keys;
  WorkerMachine machine;
  Socket control, images;
  ImagesEndpoint images_endpoint;
  const std::string first_images_endpoint = images_endpoint.text();
  std::optional<Socket> voxels;  // once the coordinator has named its endpoint
  std::string voxels_endpoint;
  PeerSockets peers;
  PictureSockets pictures;
  std::atomic<bool> registered = false;  // at least once, or stopped
  std::atomic<bool> leave_requested = false, stop_requested = false;
  std::atomic<bool> stopped = false;
  Status ended;                             // set before `stopped`
  bool stop_now = false;                    // set by the machine
  LimitedLog complaints;                    // about messages
  std::optional<Status> wrong_coordinator;  // why nobody at its endpoint can have this worker
  WorkerMetrics metrics{options.machine.memory_bytes};
  Mailbox<ExecutorOutput> outbox;  // its wakeup also signals stop_requested
  StoredVoxels stored_voxels{[this](WorkerEvent event) { outbox.Post(std::move(event)); }};
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
  stopped = true;  // first: who waits to be registered reads why it ended
  SetRegistered();
  stopped.notify_all();
}

Status WorkerService::Impl::Loop() {
  Time stop_deadline = Time::max();
  Time next_look = Time::min();
  bool leaving = false;
  HandleEvent(Tick{});
  while (!stop_now && MonotonicNow() < stop_deadline) {
    std::vector<Socket*> sockets = {&control, &images};
    if (voxels) sockets.push_back(&*voxels);
    Wait(sockets, &outbox.wakeup(), std::clamp(machine.NextWake() - MonotonicNow(), Duration::zero(), kLongestWait));
    if (executor->broken()) throw std::runtime_error("a task could not report its failure");
    for (ExecutorOutput& output : outbox.TakeAll()) HandleOutput(output);
    if (metrics.now.wanted()) metrics.now.Set(machine.counts());
    Receive<CoordinatorToWorker>(control, Plane::kControl);
    Receive<WorkerToWorker>(images, Plane::kImages);
    if (voxels) Receive<VoxelsToWorker>(*voxels, Plane::kVoxels);
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
    pictures.CloseIdle(now);
    executor->peer_memory().CloseIdle(now);
    if (wrong_coordinator) return *wrong_coordinator;
    if (control.refused() && !options.keys) {
      return Status::InvalidArgument("the coordinator at " + options.coordinator_endpoint +
                                     " has keys: name its service file, worker.json (--service)");
    }
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
      if (plane == Plane::kControl) {
        if (const auto version = OtherVersion(incoming->header())) {
          wrong_coordinator =
              Status::Unavailable("the coordinator at " + options.coordinator_endpoint + " " + TextOfOtherVersion(*version));
        } else if (const std::optional<Status> refusal = RefusalIn(incoming->header())) {
          wrong_coordinator = Status(refusal->code(), "--coordinator " + options.coordinator_endpoint + ": " + refusal->message());
        }
      }
      complaints.Warning(std::string(NameOf(plane)) + " plane: dropped a message: " + decoded.status().message());
      continue;
    }
    MessageToWorker message = Widen<MessageToWorker>(*std::move(decoded));
    if (!ComesFromItsSender(*incoming, message)) {
      complaints.Warning(std::string(NameOf(plane)) + " plane: dropped a message of another worker than it says");
      continue;
    }
    if (auto* partial = std::get_if<PartialImage>(&message); partial != nullptr && partial->shared) {
      if (const Status opened = executor->peer_memory().Open(partial->shared->arena, MonotonicNow()).status(); !opened.ok()) {
        LogInfo("an image of worker " + std::to_string(partial->from_worker) + " cannot be read in its memory: " + opened.message());
        HandleEvent(ImageUnreadable{std::move(*partial)});
        continue;
      }
    }
    if (const auto* group = std::get_if<GroupAssignment>(&message);
        group != nullptr && group->pictures && ShareOf(group->group, group->display, machine.worker()))
      pictures.Prepare(*group->pictures, MonotonicNow());
    HandleEvent(MessageReceived{std::move(message), std::move(payload)});
  }
}

bool WorkerService::Impl::ComesFromItsSender(const Incoming& incoming, const MessageToWorker& message) const {
  if (incoming.user.empty()) return true;
  const Peer* const sender = machine.FindPeer(SenderOf(message));
  return sender == nullptr || sender->images_key == incoming.user;
}

void WorkerService::Impl::HandleEvent(WorkerEvent event) {
  const bool was_registered = machine.registered();
  for (WorkerAction& action : machine.Step(std::move(event), MonotonicNow())) {
    std::visit([this](auto& each) { Perform(each); }, action);
  }
  if (was_registered && !machine.registered() && !stop_now) LogInfo("has lost its coordinator, and registers again");
  if (was_registered || !machine.registered()) return;
  LogInfo("registered as worker " + std::to_string(machine.worker()) + " at " + options.coordinator_endpoint);
  SetRegistered();
}

void WorkerService::Impl::SetRegistered() {
  if (!registered.exchange(true)) registered.notify_all();
}

void WorkerService::Impl::HandleOutput(ExecutorOutput& output) {
  if (auto* event = std::get_if<WorkerEvent>(&output)) {
    metrics.Count(*event);
    HandleEvent(std::move(*event));
  } else if (auto* frame = std::get_if<OutgoingFrame>(&output)) {
    const Status sent = Guarded("send", [&] {
      if (options.task_hook) options.task_hook("send");
      return Send(*frame);
    });
    metrics.CountSent(Plane::kPictures, frame->payload.size(), sent.ok());
    if (!sent.ok()) HandleEvent(SendFailed{frame->key, sent});
  } else {
    auto& partial = std::get<OutgoingPartial>(output);
    if (partial.timed) HandleEvent(PartialSent{partial.to.worker, partial.acknowledge, partial.payload.size()});
    Status sent;
    const Status tried = Guarded("send", [&] {
      if (options.task_hook) options.task_hook("send");
      sent = peers.Send(partial.to, std::move(partial.header), partial.payload, MonotonicNow());
    });
    metrics.CountSent(Plane::kImages, partial.payload.size(), tried.ok() && sent.ok());
    if (!tried.ok()) return HandleEvent(SendFailed{partial.key, tried});  // no fault of the peer's
    if (sent.ok()) return;
    LogWarning("worker " + std::to_string(partial.to.worker) + " is not reached: " + sent.message());
    HandleEvent(PeerUnreachable{partial.to.worker});
  }
}

Status WorkerService::Impl::Send(OutgoingFrame& frame) {
  PictureShare& share = frame.message.picture;
  const SentPicture picture{.digest = share.runs.digest, .bytes = frame.payload.size()};
  share.direct = frame.pictures && !frame.payload.empty() && pictures.Send(*frame.pictures, picture, frame.payload, MonotonicNow());
  return control.Send({}, Encode(frame.message), share.direct ? Bytes() : frame.payload);
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
  if (action.stored != nullptr && stored_voxels.Read(action, executor->BoxOf(action.padded), MonotonicNow())) return;
  if (ReadsHeld(action)) return;
  if (voxels) Send(*voxels, action.request);
}

// A box keeps the whole volume there. A process with a limit counts the voxels of the box alone, so its boxes have copies.
bool WorkerService::Impl::ReadsHeld(const SendChunkRequest& action) {
  const ChunkRequest& request = action.request;
  const bool may_share = options.find_held && options.machine.memory_bytes == 0;
  if (!may_share || action.stored != nullptr || IsCellChunk(request.chunk)) return false;
  std::shared_ptr<const HeldVoxels> held = options.find_held(request.dataset);
  if (held == nullptr) return false;
  const std::uint64_t stored_bytes = held->read_from == nullptr ? 0 : held->read_from->TakeStoredBytes();
  executor->BoxOf(action.padded)->Hold(std::move(held));
  outbox.Post(WorkerEvent(ChunkStored{action.padded, request.box, request.chunk, {}, stored_bytes}));
  return true;
}

void WorkerService::Impl::Perform(ConnectVoxels& action) {
  if (voxels && action.endpoint == voxels_endpoint) return;  // the socket reconnects by itself
  voxels.reset();
  Result<Socket> socket = Socket::Dealer(context, {.client_keys = options.keys});
  const Status connected = socket.ok() ? socket->Connect(action.endpoint) : socket.status();
  if (!connected.ok()) {
    LogError("voxels plane: " + connected.message());  // chunk requests time out and are reported
    return;
  }
  voxels = std::move(*socket);
  voxels_endpoint = action.endpoint;
}

void WorkerService::Impl::Perform(ResendImage& action) {
  if (action.first) {
    LogWarning("worker " + std::to_string(action.refused.from_worker) + " cannot read this worker's memory: its images travel in frames");
  }
  executor->Perform(action);
}

void WorkerService::Impl::Perform(AnswerPeer& action) {
  if (const Status sent = peers.Send(action.to, Encode(action.message), {}, MonotonicNow()); !sent.ok())
    LogWarning("worker " + std::to_string(action.to.worker) + " is not reached: " + sent.message());
}

void WorkerService::Impl::Perform(AdmitKeys& action) {
  context.authenticator().AdmitOnly(keys->plane, std::move(action.keys));
  for (const std::string& key : action.ended) images.EndConnections(key);
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

std::string WorkerService::MetricsText() {
  return impl_->metrics.Text([this] { impl_->outbox.wakeup().Notify(); });
}

void WorkerService::WaitUntilRegistered() { impl_->registered.wait(false); }
void WorkerService::WaitUntilStopped() { impl_->stopped.wait(false); }
bool WorkerService::stopped() const { return impl_->stopped; }
Status WorkerService::ended() const { return impl_->stopped ? impl_->ended : Status::Ok(); }

}  // namespace slabstream
