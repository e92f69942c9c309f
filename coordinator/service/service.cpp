#include "coordinator/service/service.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <deque>
#include <random>
#include <span>
#include <string_view>
#include <thread>
#include <utility>
#include <variant>

#include "common/base/limited_log.h"
#include "common/base/log.h"
#include "common/base/printable.h"
#include "common/memory/shared_arena.h"
#include "common/threads/guarded.h"
#include "common/transport/endpoint.h"
#include "common/wire/other_version.h"
#include "coordinator/service/coordinator_metrics.h"
#include "coordinator/service/owners.h"
#include "coordinator/service/peer_table.h"
#include "coordinator/service/service_keys.h"
#include "coordinator/service/voxel_server.h"

namespace slabstream {
namespace {

constexpr Duration kForgetAfter = std::chrono::minutes(10);  // silent connections; well above every timeout of the machines
constexpr Duration kForgetInterval = std::chrono::minutes(1);
constexpr Duration kLongestWait = std::chrono::seconds(1);
constexpr Duration kStopGrace = std::chrono::seconds(5);  // for the machines to end in order
constexpr std::int64_t kNotesAtOnce = 100;                // lines of the log that peers can provoke
constexpr Duration kEachNote = std::chrono::milliseconds(200);
constexpr int kReceiveBatch = 64;  // messages of one socket before the other one has its turn

Epoch RandomEpoch() {
  std::random_device device;
  const Epoch epoch = (Epoch{device()} << 32) | device();
  return epoch == 0 ? 1 : epoch;
}

std::string VoxelsEndpointFor(Endpoint client) {
  client.port = 0;
  client.path += ".voxels";
  return client.ToString();
}

// Workers that connect to `worker_endpoint` name the files of their images planes after it.
Endpoint ImagesSocketsOf(const std::string& worker_endpoint) {
  Endpoint endpoint = ParseEndpoint(worker_endpoint, false).value();
  endpoint.path += kImagesSuffix;
  return endpoint;
}

}  // namespace

struct CoordinatorService::Impl {
  Impl(CoordinatorOptions service_options, std::optional<ServiceKeys> service_keys, Socket client_socket, Socket control_socket,
       std::unique_ptr<VoxelServer> voxel_server)
      : keys(std::move(service_keys)),
        frames(service_options.machine),
        datasets({.datasets = std::move(service_options.catalogue),
                  .folders = std::move(service_options.folders),
                  .memory_bytes = service_options.machine.memory_bytes,
                  .log_level = service_options.machine.log_level}),
        clients(std::move(client_socket)),
        control(std::move(control_socket)),
        voxels(std::move(voxel_server)),
        background(std::move(service_options.make_plan), std::move(service_options.count_occupied), *voxels),
        owners(
            service_options.machine.epoch, [this](const std::string& name) { return datasets.NameIsFree(name); },
            [this] { background.wakeup().Notify(); }),
        metrics(service_options.machine.memory_bytes) {}

  void Run();
  void Loop();
  void HandleEvent(CoordinatorEvent event);  // and what follows from it
  void ReceiveFromClients();
  void ReceiveFromWorkers();  // and owners
  void Hear(const Incoming& incoming, ToControl& message, Role role);
  void Follow(Owners::News news);
  // True: a program of another version wrote the message. Its sender hears our version, so that both sides say both.
  bool AnswerOtherVersion(Socket& socket, const Incoming& incoming, Plane plane);
  // Tell the sender of a message that cannot be decoded, as far as it can be told. A refused request whose id can be read has an answer,
  // which the machine sends, so that nobody waits for it in vain.
  void RefuseWorker(const Incoming& incoming, const Status& why);
  std::optional<CoordinatorToClient> RefuseClient(const Incoming& incoming, const Status& why);
  // What the sender may do; nullopt: its key was revoked. Without keys only this machine can connect, and may do everything.
  std::optional<Role> RoleOf(const Incoming& incoming) { return incoming.user.empty() ? Role::kAdmin : keys->RoleOf(incoming); }
  bool CarryOut(const Incoming& incoming, const ClientToCoordinator& message, Role role);
  // The same to each of them. Who cannot be told is Gone.
  template <class Gone>
  void Send(Socket& socket, PeerTable& peers, std::span<const PeerToken> to, MessageView message, const Bytes& payload);

  template <class Event>
  auto& MachineOf(const Event&) {
    if constexpr (std::constructible_from<FrameEvent, Event>) {
      return frames;
    } else {
      return datasets;
    }
  }
  void Step(auto& machine, auto&& event);
  void CountFrames(const std::vector<FrameAction>& actions);
  // One for each kind of action.
  void Perform(ToDatasets& action) { Step(datasets, action); }
  void Perform(DatasetNews& action) { Step(frames, action); }
  void Perform(TellWorkers& action) { Send<WorkerGone>(control, worker_peers, action.to, action.message, {}); }
  void Perform(ToClient& action) {
    if (auto* const status = std::get_if<StatusReply>(&action.message)) owners.Describe(status->datasets);
    if (auto* const data = std::get_if<DataReply>(&action.message)) owners.Describe(data->datasets);
    Send<ClientGone>(clients, client_peers, std::span(&action.to, 1), action.message, action.payload);
  }
  void Perform(DropClient& action) {
    if (const std::string* identity = client_peers.IdentityOf(action.client)) clients.EndConnection(*identity);
  }
  void Perform(Note& action) { notes[std::size_t(action.about)].Write(action.level, Printable(std::move(action.text))); }
  void Perform(StopService&) { stop_now = true; }
  template <class Action>
  void Perform(Action& action) {
    if (BackgroundActions::AtOnce event = background.Perform(action)) following.push_back(*std::move(event));
  }

  std::string client_endpoint, worker_endpoint;
  Endpoint images_sockets;  // how the files of workers' images planes begin, if they are files
  std::optional<ServiceKeys> keys;
  FrameMachine frames;
  DatasetMachine datasets;
  Socket clients, control;
  PeerTable client_peers, worker_peers;
  std::unique_ptr<VoxelServer> voxels;
  std::deque<CoordinatorEvent> following;  // what actions led to: heard after all actions of the event at hand
  BackgroundActions background;            // its wakeup also signals stop_requested
  Owners owners;
  std::atomic<bool> stop_requested = false;
  std::atomic<bool> stopped = false;
  bool stop_now = false;  // a machine said so
  LimitedLog complaints;  // about messages
  // By NoteAbout: each has its own limit, so that no client's frames keep a worker's loss out of the log.
  std::array<LimitedLog, 3> notes = {LimitedLog(kNotesAtOnce, kEachNote), LimitedLog(kNotesAtOnce, kEachNote),
                                     LimitedLog(kNotesAtOnce, kEachNote)};
  Time next_forget;
  CoordinatorMetrics metrics;
  std::jthread thread;  // owns the sockets and the machines; last member: ends first
};

void CoordinatorService::Impl::Run() {
  RemoveDeadSockets(images_sockets);  // of workers of an earlier coordinator
  const Status ended = Guarded("coordinator", [&] { Loop(); });
  if (!ended.ok()) {
    LogError("the coordinator stops: " + ended.message());
    (void)Guarded("coordinator", [&] {
      HandleEvent(CoordinatorStopRequested{ended.message()});
      return Status::Ok();
    });
  }
  RemoveDeadSockets(images_sockets);
  { const std::array<Socket, 2> closed = {std::move(clients), std::move(control)}; }  // a client in this process notices the end by it
  stopped = true;
  stopped.notify_all();
}

void CoordinatorService::Impl::Loop() {
  const std::array<Socket*, 2> sockets = {&clients, &control};
  Time stop_deadline = Time::max();
  HandleEvent(CoordinatorTick{});
  HandleEvent(DatasetTick{});
  next_forget = MonotonicNow() + kForgetInterval;
  while (!stop_now && MonotonicNow() < stop_deadline) {
    Wait(sockets, &background.wakeup(),
         std::clamp(std::min(frames.NextWake(), datasets.NextWake()) - MonotonicNow(), Duration::zero(), kLongestWait));
    background.HandleEvents([this](CoordinatorEvent event) { HandleEvent(std::move(event)); });
    if (metrics.now.wanted()) metrics.now.Set({frames.counts(), datasets.counts()});
    ReceiveFromWorkers();
    ReceiveFromClients();
    const Time now = MonotonicNow();
    Follow(owners.Tend(now));
    if (frames.NextWake() <= now) HandleEvent(CoordinatorTick{});
    if (datasets.NextWake() <= now) HandleEvent(DatasetTick{});
    if (stop_requested && stop_deadline == Time::max()) {
      stop_deadline = now + kStopGrace;
      HandleEvent(CoordinatorStopRequested{});
    }
    if (now >= next_forget) {
      client_peers.ForgetSilentSince(now - kForgetAfter);
      worker_peers.ForgetSilentSince(now - kForgetAfter);
      RemoveDeadSockets(images_sockets);
      next_forget = now + kForgetInterval;
    }
  }
}

void CoordinatorService::Impl::HandleEvent(CoordinatorEvent event) {
  following.push_back(std::move(event));
  while (!following.empty()) {
    CoordinatorEvent next = std::move(following.front());
    following.pop_front();
    std::visit([this](auto& each) { Step(MachineOf(each), std::move(each)); }, next);
  }
}

void CoordinatorService::Impl::Step(auto& machine, auto&& event) {
  const std::uint64_t done_before = frames.frames_done();
  auto actions = machine.Step(std::forward<decltype(event)>(event), MonotonicNow());
  if constexpr (std::same_as<decltype(actions), std::vector<FrameAction>>) {
    if (frames.frames_done() != done_before) CountFrames(actions);
  }
  for (auto& action : actions) {
    std::visit([this](auto& each) { Perform(each); }, action);
  }
}

// Of a step that has made a frame: its answer is among the actions. Answers that are sent again are not of such steps.
void CoordinatorService::Impl::CountFrames(const std::vector<FrameAction>& actions) {
  for (const FrameAction& action : actions) {
    const auto* const to_client = std::get_if<ToClient>(&action);
    const auto* const reply = to_client == nullptr ? nullptr : std::get_if<FrameReply>(&to_client->message);
    if (reply != nullptr && reply->groups_done == reply->group_count) metrics.CountFrame(reply->statistics);
  }
}

// A peer is gone if it cannot be reached, does not take its messages, or cannot be sent one for want of memory. The machine hears of it
// after the actions at hand, not between them.
template <class Gone>
void CoordinatorService::Impl::Send(Socket& socket, PeerTable& peers, std::span<const PeerToken> to, MessageView message,
                                    const Bytes& payload) {
  std::vector<std::byte> header;
  const Status encoded = Guarded("encoding", [&] { header = Encode(message); });
  for (const PeerToken peer : to) {
    const std::string* const identity = peers.IdentityOf(peer);
    Status sent = encoded;
    if (sent.ok() && identity == nullptr) sent = Status::Unavailable("forgotten connection");
    if (sent.ok()) sent = Guarded("send", [&] { return socket.Send(*identity, header, payload); });
    if (sent.ok()) continue;
    LogDebug(std::string(NameOf(message)) + " not sent: " + sent.message());
    peers.Forget(peer);
    following.push_back(Gone{peer});
  }
}

bool CoordinatorService::Impl::AnswerOtherVersion(Socket& socket, const Incoming& incoming, Plane plane) {
  const std::optional<std::uint32_t> version = OtherVersion(incoming.header());
  if (!version) return false;
  complaints.Warning(fmt::format("{} plane: a peer {} {}", NameOf(plane), incoming.host.empty() ? "of this machine" : "at " + incoming.host,
                                 TextOfOtherVersion(*version)));
  (void)socket.Send(incoming.identity, VersionNotice());  // a peer that has gone needs none
  return true;
}

void CoordinatorService::Impl::RefuseWorker(const Incoming& incoming, const Status& why) {
  if (AnswerOtherVersion(control, incoming, Plane::kControl)) return;
  complaints.Warning("control plane: dropped a message: " + why.message());
  if (!Decode<ClientToCoordinator>(incoming.header()).ok()) return;
  const Status elsewhere = Status::InvalidArgument("this is the endpoint for workers; clients connect to " + client_endpoint);
  (void)control.Send(incoming.identity, Encode(OrderRefused{.nonce = 0, .status = elsewhere}));
}

std::optional<CoordinatorToClient> CoordinatorService::Impl::RefuseClient(const Incoming& incoming, const Status& why) {
  if (AnswerOtherVersion(clients, incoming, Plane::kClient)) return std::nullopt;
  complaints.Warning("client plane: refused a message: " + why.message());
  if (!Decode<WorkerToCoordinator>(incoming.header()).ok()) return RefusalOf(incoming.header(), why);
  const Status elsewhere = Status::InvalidArgument("this is the endpoint for clients; workers connect to " + worker_endpoint);
  (void)clients.Send(incoming.identity, Encode(OrderRefused{.nonce = 0, .status = elsewhere}));  // a worker would wait for ever
  return std::nullopt;
}

void CoordinatorService::Impl::ReceiveFromWorkers() {
  for (int i = 0; i < kReceiveBatch; ++i) {
    std::optional<Incoming> incoming = control.TryReceive();
    if (!incoming) return;
    const std::optional<Role> role = RoleOf(*incoming);
    if (!role) continue;
    Result<ToControl> message = Guarded("decoding", [&] { return Decode<ToControl>(incoming->header(), incoming->payload().size()); });
    if (!message.ok()) {
      // Guarded, as decoding is: a message that nobody understands must not end the service.
      const Status refused = Guarded("refusing", [&] { RefuseWorker(*incoming, message.status()); });
      if (!refused.ok()) complaints.Warning("control plane: " + refused.message());
      continue;
    }
    Hear(*incoming, *message, *role);
  }
}

void CoordinatorService::Impl::Hear(const Incoming& incoming, ToControl& message, Role role) {
  const Time now = MonotonicNow();
  std::visit(
      [&]<class Message>(Message& each) {
        constexpr bool of_worker = std::constructible_from<WorkerToCoordinator, Message>;
        if (role == (of_worker ? Role::kOwner : Role::kWorker)) {
          return complaints.Warning(fmt::format("control plane: {} needs a key of another role than {}", NameOf(each), NameOf(role)));
        }
        const PeerToken from = worker_peers.Heard(incoming.identity, now);
        if constexpr (of_worker) {
          HandleEvent(FromWorker{from, std::move(each), incoming.payload()});
        } else {
          Follow(owners.Hear(from, std::move(each), incoming.payload(), now));
        }
      },
      message);
}

void CoordinatorService::Impl::Follow(Owners::News news) {
  for (const auto& [owner, message] : news.messages) {
    Send<WorkerGone>(control, worker_peers, std::span(&owner, 1), message, {});
    if (worker_peers.IdentityOf(owner) == nullptr) Follow(owners.Gone(owner, MonotonicNow()));
  }
  for (OwnedData& data : news.datasets) HandleEvent(std::move(data));
}

void CoordinatorService::Impl::ReceiveFromClients() {
  for (int i = 0; i < kReceiveBatch; ++i) {
    const std::optional<Incoming> incoming = clients.TryReceive();
    if (!incoming) return;
    const std::optional<Role> role = RoleOf(*incoming);
    if (!role) continue;
    Result<ClientToCoordinator> message =
        Guarded("decoding", [&] { return Decode<ClientToCoordinator>(incoming->header(), incoming->payload().size()); });
    if (!message.ok()) {
      std::optional<CoordinatorToClient> refusal;
      const Status refused = Guarded("refusing", [&] { refusal = RefuseClient(*incoming, message.status()); });
      if (!refused.ok()) complaints.Warning("client plane: " + refused.message());
      if (refusal) HandleEvent(BadRequest{client_peers.Heard(incoming->identity, MonotonicNow()), *std::move(refusal), message.status()});
      continue;
    }
    if (CarryOut(*incoming, *message, *role)) continue;
    std::visit(
        [&, from = client_peers.Heard(incoming->identity, MonotonicNow())]<class Message>(Message& each) {
          if constexpr (std::constructible_from<ClientToFrames, Message>) {
            HandleEvent(FromClient{from, std::move(each), incoming->host, clients.UnsentBytes(incoming->identity)});
          } else if constexpr (std::constructible_from<ClientToDatasets, Message>) {
            HandleEvent(ClientHeard{from, std::is_same_v<Message, AddVolume>});
            HandleEvent(ClientAsked{from, std::move(each), incoming->payload()});
          }
        },
        *message);
  }
}

// True: the message was an order about keys or simulations, or one that its sender may not give. Datasets may be listed by every client.
bool CoordinatorService::Impl::CarryOut(const Incoming& incoming, const ClientToCoordinator& message, Role role) {
  const auto reply = [&](MessageView answer) { (void)clients.Send(incoming.identity, Encode(answer)); };
  const auto refuse = [&](std::uint64_t nonce, std::string why) { reply(OrderRefused{nonce, Status::InvalidArgument(std::move(why))}); };
  const auto only_admin = [&](std::uint64_t nonce, std::string_view what) {
    if (role != Role::kAdmin) refuse(nonce, fmt::format("{} needs the service file of role admin, not {}", what, NameOf(role)));
    return role != Role::kAdmin;
  };
  if (const auto* end = std::get_if<ShutDown>(&message)) return only_admin(end->nonce, "ending the service");
  if (const auto* add = std::get_if<AddVolume>(&message)) return only_admin(add->nonce, "adding a volume");
  if (const auto* data = std::get_if<DataOrder>(&message)) {
    return data->action != DataAction::kList && only_admin(data->nonce, "adding, removing and reloading datasets");
  }
  if (const auto* steer = std::get_if<SteerDataset>(&message)) {  // whoever may watch a simulation may steer it, as far as it lets them
    const Result<SimulationStatus> steered = owners.Steer(*steer);
    steered.ok() ? reply(SteerReply{steer->nonce, *steered}) : reply(OrderRefused{steer->nonce, Bounded(steered.status())});
    return true;
  }
  const auto* order = std::get_if<KeysOrder>(&message);
  if (order == nullptr) return false;
  if (!keys) {
    refuse(order->nonce, "the service has no keys: it stays on its machine");
  } else if (role != Role::kAdmin) {
    refuse(order->nonce, fmt::format("orders about keys need the service file of role admin, not {}", NameOf(role)));
  } else {
    const ServiceKeys::Done done = keys->CarryOut(*order);
    reply(done.answer);
    if (done.revoked) {
      clients.EndConnections(*done.revoked);
      control.EndConnections(*done.revoked);
      voxels->EndConnections(*done.revoked);
    }
  }
  return true;
}

Result<std::unique_ptr<CoordinatorService>> CoordinatorService::Start(Context& context, CoordinatorOptions options) {
  const Result<Endpoint> client_wanted = ParseEndpoint(options.client_endpoint, true);
  if (!client_wanted.ok()) return client_wanted.status();
  if (options.worker_endpoint.empty()) options.worker_endpoint = WorkerEndpointFor(*client_wanted).ToString();
  if (options.voxels_endpoint.empty()) options.voxels_endpoint = VoxelsEndpointFor(*client_wanted);
  for (const std::string& endpoint : {options.worker_endpoint, options.voxels_endpoint}) {
    if (const Result<Endpoint> parsed = ParseEndpoint(endpoint, true); !parsed.ok()) return parsed.status();
  }

  options.machine.epoch = RandomEpoch();
  std::optional<ServiceKeys> keys;
  if (!options.keys_folder.empty()) {
    Result<ServiceKeys> opened = ServiceKeys::Open(context, options.keys_folder, options.machine.epoch);
    if (!opened.ok()) return opened.status();
    keys = *std::move(opened);
  }
  const auto options_of = [&](Plane plane) {
    SocketOptions of;
    if (keys) of.server_keys = keys->For(plane);
    if (plane == Plane::kClient) {
      of.max_message_bytes = kMaxRequestBytes;
      of.ends_connections = true;
    }
    return of;
  };
  Result<Socket> clients = Socket::Router(context, options_of(Plane::kClient));
  if (!clients.ok()) return clients.status();
  Result<Socket> control = Socket::Router(context, options_of(Plane::kControl));
  if (!control.ok()) return control.status();
  Result<std::string> client_endpoint = clients->Bind(options.client_endpoint);
  if (!client_endpoint.ok()) return client_endpoint.status();
  Result<std::string> worker_endpoint = control->Bind(options.worker_endpoint);
  if (!worker_endpoint.ok()) return worker_endpoint.status();
  Result<std::unique_ptr<VoxelServer>> voxels =
      VoxelServer::Start(context, {options.voxels_endpoint, options_of(Plane::kVoxels)}, options.machine.epoch, options.codec);
  if (!voxels.ok()) return voxels.status();
  if (keys) {
    if (Status published = keys->Publish(*client_endpoint, *worker_endpoint); !published.ok()) return published;
  }

  options.machine.pid = static_cast<std::uint32_t>(::getpid());
  options.machine.voxels_endpoint = (*voxels)->endpoint();
  auto impl = std::make_unique<Impl>(std::move(options), std::move(keys), std::move(*clients), std::move(*control), std::move(*voxels));
  impl->client_endpoint = std::move(*client_endpoint);
  impl->worker_endpoint = std::move(*worker_endpoint);
  impl->images_sockets = ImagesSocketsOf(impl->worker_endpoint);
  impl->thread = std::jthread([raw = impl.get()] { raw->Run(); });
  return std::unique_ptr<CoordinatorService>(new CoordinatorService(std::move(impl)));
}

CoordinatorService::CoordinatorService(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
CoordinatorService::~CoordinatorService() { RequestStop(); }

const std::string& CoordinatorService::client_endpoint() const { return impl_->client_endpoint; }
const std::string& CoordinatorService::worker_endpoint() const { return impl_->worker_endpoint; }

void CoordinatorService::RequestStop() {
  impl_->stop_requested = true;
  impl_->background.wakeup().Notify();
}

std::string CoordinatorService::MetricsText() {
  return impl_->metrics.Text([this] { impl_->background.wakeup().Notify(); });
}

std::shared_ptr<const HeldVoxels> CoordinatorService::FindHeld(DatasetId dataset) { return impl_->voxels->FindHeld(dataset); }

void CoordinatorService::WaitUntilStopped() { impl_->stopped.wait(false); }
bool CoordinatorService::stopped() const { return impl_->stopped; }

}  // namespace slabstream
