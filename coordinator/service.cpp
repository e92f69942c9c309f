#include "coordinator/service.h"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <exception>
#include <new>
#include <random>
#include <thread>
#include <utility>
#include <variant>

#include "common/base/log.h"
#include "common/base/shared_arena.h"
#include "common/base/task_thread.h"
#include "common/transport/endpoint.h"
#include "common/transport/mailbox.h"
#include "coordinator/peer_table.h"
#include "coordinator/slab_server.h"

namespace slabstream {
namespace {

constexpr Duration kForgetAfter = std::chrono::minutes(10);  // silent connections; well above every timeout of the machine
constexpr Duration kForgetInterval = std::chrono::minutes(1);
constexpr Duration kLongestWait = std::chrono::seconds(1);
constexpr Duration kStopGrace = std::chrono::seconds(5);  // for the machine to end in order
constexpr int kReceiveBatch = 64;                         // messages of one socket before the other one has its turn

Epoch RandomEpoch() {
  std::random_device device;
  const Epoch epoch = (Epoch{device()} << 32) | device();
  return epoch == 0 ? 1 : epoch;
}

std::string SlabsEndpointFor(Endpoint client) {
  client.port = 0;
  client.path += ".slabs";
  return client.ToString();
}

// Whether at least half of the volume's bricks hold one value each.
bool MostBricksAreEqual(const VolumeSummary& summary) {
  const auto equal = std::ranges::count_if(summary.bricks, [](const ValueRange& range) { return range.min == range.max; });
  return 2 * std::size_t(equal) >= summary.bricks.size();
}

Status LoadFailure(const std::string& name, const std::string& reason) {
  return Status::ResourceExhausted("dataset \"" + name + "\" could not be loaded: " + reason);
}

}  // namespace

struct CoordinatorService::Impl {
  Impl(CoordinatorOptions service_options, Socket client_socket, Socket control_socket, std::unique_ptr<SlabServer> slab_server)
      : catalogue(std::move(service_options.catalogue)),
        machine(std::move(service_options.machine)),
        clients(std::move(client_socket)),
        control(std::move(control_socket)),
        slabs(std::move(slab_server)) {}

  void Run();
  void HandleEvent(const CoordinatorEvent& event);
  void Perform(CoordinatorAction& action);
  void ReceiveFromClients();
  void ReceiveFromWorkers();
  void Send(Socket& socket, PeerTable& peers, PeerToken to, const AnyMessage& message, const Bytes& payload, const CoordinatorEvent& gone);
  void Load(const LoadDataset& action);
  void Count(const CountDataset& action);

  std::string client_endpoint, worker_endpoint;
  const Catalogue catalogue;
  FrameMachine machine;
  Socket clients, control;
  PeerTable client_peers, worker_peers;
  std::unique_ptr<SlabServer> slabs;
  Mailbox<CoordinatorEvent> inbox;  // from the loader and from failed sends; its wakeup also tells of stop_requested
  std::atomic<bool> stop_requested = false;
  std::atomic<bool> stopped = false;
  bool stop_now = false;  // the machine said so
  Time next_forget;
  TaskThread loader;
  std::jthread thread;  // owns the sockets and the machine; last member: ends first
};

void CoordinatorService::Impl::Run() {
  const std::array<Socket*, 2> sockets = {&clients, &control};
  Time stop_deadline = Time::max();
  HandleEvent(CoordinatorTick{});
  while (!stop_now && MonotonicNow() < stop_deadline) {
    Wait(sockets, &inbox.wakeup(), std::clamp(machine.NextWake() - MonotonicNow(), Duration::zero(), kLongestWait));
    for (const CoordinatorEvent& event : inbox.TakeAll()) HandleEvent(event);
    ReceiveFromWorkers();
    ReceiveFromClients();
    const Time now = MonotonicNow();
    if (machine.NextWake() <= now) HandleEvent(CoordinatorTick{});
    if (stop_requested && stop_deadline == Time::max()) {
      stop_deadline = now + kStopGrace;
      HandleEvent(CoordinatorStopRequested{});
    }
    if (now >= next_forget) {
      client_peers.ForgetSilentSince(now - kForgetAfter);
      worker_peers.ForgetSilentSince(now - kForgetAfter);
      next_forget = now + kForgetInterval;
    }
  }
  stopped = true;
  stopped.notify_all();
}

void CoordinatorService::Impl::HandleEvent(const CoordinatorEvent& event) {
  for (CoordinatorAction& action : machine.Step(event, MonotonicNow())) Perform(action);
}

void CoordinatorService::Impl::Perform(CoordinatorAction& action) {
  if (const auto* to_worker = std::get_if<ToWorker>(&action)) {
    Send(control, worker_peers, to_worker->to, to_worker->message, {}, WorkerGone{to_worker->to});
  } else if (const auto* to_client = std::get_if<ToClient>(&action)) {
    Send(clients, client_peers, to_client->to, to_client->message, to_client->payload, ClientGone{to_client->to});
  } else if (const auto* load = std::get_if<LoadDataset>(&action)) {
    Load(*load);
  } else if (const auto* count = std::get_if<CountDataset>(&action)) {
    Count(*count);
  } else {
    static_assert(std::variant_size_v<CoordinatorAction> == 5);
    stop_now = true;
  }
}

// A peer that cannot be reached, or that does not take its messages, is gone. The machine hears of it after the actions at hand, not
// between them.
void CoordinatorService::Impl::Send(Socket& socket, PeerTable& peers, PeerToken to, const AnyMessage& message, const Bytes& payload,
                                    const CoordinatorEvent& gone) {
  const std::string* identity = peers.IdentityOf(to);
  const Status sent = identity == nullptr ? Status::Unavailable("forgotten connection") : socket.Send(*identity, Encode(message), payload);
  if (sent.ok()) return;
  LogDebug(std::string(NameOf(message)) + " not sent: " + sent.message());
  peers.Forget(to);
  inbox.Post(gone);
}

void CoordinatorService::Impl::ReceiveFromWorkers() {
  for (int i = 0; i < kReceiveBatch; ++i) {
    std::optional<Incoming> incoming = control.TryReceive();
    if (!incoming) return;
    Result<AnyMessage> message = Decode(incoming->parts[0].span());
    Bytes payload = incoming->parts.size() > 1 ? std::move(incoming->parts[1]) : Bytes();
    if (!message.ok() || payload.size() != ExpectedPayloadBytes(*message)) {
      LogWarning("control plane: dropped a message: " +
                 (message.ok() ? std::string(NameOf(*message)) + " with a payload of " + std::to_string(payload.size()) + " bytes"
                               : message.status().message()));
      continue;
    }
    HandleEvent(FromWorker{worker_peers.Heard(incoming->identity, MonotonicNow()), std::move(*message), std::move(payload)});
  }
}

void CoordinatorService::Impl::ReceiveFromClients() {
  for (int i = 0; i < kReceiveBatch; ++i) {
    const std::optional<Incoming> incoming = clients.TryReceive();
    if (!incoming) return;
    Result<AnyMessage> message = Decode(incoming->parts[0].span());
    if (!message.ok()) {
      LogWarning("client plane: refused a message: " + message.status().message());
      // A request that can be told by its id gets its answer, so that nobody waits for what will never come.
      if (const std::optional<AnyMessage> refusal = RefusalOf(incoming->parts[0].span(), message.status())) {
        (void)clients.Send(incoming->identity, Encode(*refusal));
      }
      continue;
    }
    HandleEvent(FromClient{client_peers.Heard(incoming->identity, MonotonicNow()), std::move(*message)});
  }
}

void CoordinatorService::Impl::Load(const LoadDataset& action) {
  loader.Post([this, name = action.name, dataset = action.dataset] {
    const auto load = [&]() -> CoordinatorEvent {
      try {
        const Result<std::shared_ptr<const Volume>> volume = catalogue.at(name)();
        if (!volume.ok()) return DatasetFailed{name, volume.status()};
        auto summary = std::make_shared<const VolumeSummary>(Summarize(**volume));
        // Before the machine can send anybody for its voxels.
        if (MostBricksAreEqual(*summary)) {
          slabs->Publish(dataset, std::make_shared<const BrickedVoxels>((*volume)->block));
        } else {
          slabs->Publish(dataset, *volume);
        }
        return DatasetLoaded{name, dataset, std::move(summary)};
      } catch (const std::bad_alloc&) {
        return DatasetFailed{name, LoadFailure(name, "not enough memory")};
      } catch (const std::exception& error) {  // of libraries below the reader
        return DatasetFailed{name, LoadFailure(name, error.what())};
      }
    };
    inbox.Post(load());
  });
}

void CoordinatorService::Impl::Count(const CountDataset& action) {
  loader.Post([this, action] {
    const auto count = [&]() -> Result<std::shared_ptr<const OccupancyGrid>> {
      try {
        return std::make_shared<const OccupancyGrid>(slabs->CountOccupied(action.dataset, *action.table));
      } catch (const std::bad_alloc&) {
        return Status::ResourceExhausted("occupied voxels could not be counted: not enough memory");
      }
    };
    inbox.Post(OccupiedCounted{action.count, count()});
  });
}

Result<std::unique_ptr<CoordinatorService>> CoordinatorService::Start(Context& context, CoordinatorOptions options) {
  const Result<Endpoint> client_wanted = ParseEndpoint(options.client_endpoint, true);
  if (!client_wanted.ok()) return client_wanted.status();
  if (options.worker_endpoint.empty()) options.worker_endpoint = WorkerEndpointFor(*client_wanted).ToString();
  if (options.slabs_endpoint.empty()) options.slabs_endpoint = SlabsEndpointFor(*client_wanted);
  for (const std::string& endpoint : {options.worker_endpoint, options.slabs_endpoint}) {
    if (const Result<Endpoint> parsed = ParseEndpoint(endpoint, true); !parsed.ok()) return parsed.status();
  }

  SocketOptions client_options;
  client_options.max_message_bytes = kMaxRequestBytes;
  Result<Socket> clients = Socket::Router(context, client_options);
  if (!clients.ok()) return clients.status();
  Result<Socket> control = Socket::Router(context);
  if (!control.ok()) return control.status();
  Result<std::string> client_endpoint = clients->Bind(options.client_endpoint);
  if (!client_endpoint.ok()) return client_endpoint.status();
  Result<std::string> worker_endpoint = control->Bind(options.worker_endpoint);
  if (!worker_endpoint.ok()) return worker_endpoint.status();
  options.machine.epoch = RandomEpoch();
  Result<std::unique_ptr<SlabServer>> slabs = SlabServer::Start(context, options.slabs_endpoint, options.machine.epoch, options.codec);
  if (!slabs.ok()) return slabs.status();

  options.machine.pid = static_cast<std::uint32_t>(::getpid());
  options.machine.slabs_endpoint = (*slabs)->endpoint();
  options.machine.surroundings.memory_scope = SharedMemoryScope();
  options.machine.surroundings.cores = std::int32_t(std::max(std::thread::hardware_concurrency(), 1U));
  options.machine.datasets.clear();
  for (const auto& [name, loader] : options.catalogue) options.machine.datasets.push_back(name);
  auto impl = std::make_unique<Impl>(std::move(options), std::move(*clients), std::move(*control), std::move(*slabs));
  impl->client_endpoint = std::move(*client_endpoint);
  impl->worker_endpoint = std::move(*worker_endpoint);
  impl->thread = std::jthread([raw = impl.get()] { raw->Run(); });
  return std::unique_ptr<CoordinatorService>(new CoordinatorService(std::move(impl)));
}

CoordinatorService::CoordinatorService(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
CoordinatorService::~CoordinatorService() { RequestStop(); }

const std::string& CoordinatorService::client_endpoint() const { return impl_->client_endpoint; }
const std::string& CoordinatorService::worker_endpoint() const { return impl_->worker_endpoint; }

void CoordinatorService::RequestStop() {
  impl_->stop_requested = true;
  impl_->inbox.wakeup().Notify();
}

void CoordinatorService::WaitUntilStopped() { impl_->stopped.wait(false); }
bool CoordinatorService::stopped() const { return impl_->stopped; }

}  // namespace slabstream
