#include "client/owner/volume_owner.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <condition_variable>
#include <mutex>
#include <random>
#include <thread>
#include <utility>
#include <vector>

#include "common/base/overloaded.h"
#include "common/service/service_file.h"
#include "common/threads/guarded.h"
#include "common/transport/socket.h"
#include "common/wire/any_message.h"
#include "common/wire/payload.h"
#include "data/owned/owned_source.h"
#include "data/owned/voxel_lattice.h"
#include "data/sources/copy_samples.h"

namespace slabstream {
namespace {

constexpr std::uint32_t kMostOwners = 4096;  // as of RegisterOwner
constexpr Duration kRegisterAgain = std::chrono::seconds(1);
constexpr Duration kOthersLeave = std::chrono::seconds(10);  // what an owner before this one needs to be lost

}  // namespace

struct VolumeOwner::Impl {
  Impl(RegisterOwner as, OwnerLayout of_layout, std::shared_ptr<OwnerMemory> of_owner, std::shared_ptr<const MappedOwner> mapped,
       Socket to_coordinator)
      : registration(std::move(as)),
        layout(std::move(of_layout)),
        memory(std::move(of_owner)),
        own(std::move(mapped)),
        socket(std::move(to_coordinator)),
        thread([this](const std::stop_token& stop) { Run(stop); }) {}

  void Run(const std::stop_token& stop);
  void Hear(CoordinatorToOwner message, Time now);
  void Answer(const ChunkRequest& request);
  void Send(MessageView message, const Bytes& payload = {}) { (void)socket.Send({}, Encode(message), payload); }
  void Forget();                                  // the coordinator: nobody uses a time any more
  std::optional<std::uint32_t> FreeSlot() const;  // of the oldest time; with the mutex
  void Tell(const auto& change) {
    const std::lock_guard lock(mutex);
    change();
    changed.notify_all();
  }

  RegisterOwner registration;  // steered: the thread changes values, with the mutex
  const OwnerLayout layout;
  const std::shared_ptr<OwnerMemory> memory;
  const std::shared_ptr<const MappedOwner> own;  // the same memory, to be read while it is written
  Wakeup wakeup;

  mutable std::mutex mutex;  // guards what follows
  std::condition_variable changed;
  std::array<std::uint64_t, kMostOwnerSlots> times = {};  // 0: none
  std::uint64_t latest = 0, gone = 0;                     // gone: the latest time that was overwritten
  double simulated = 0;
  std::vector<std::uint64_t> used;  // ascending
  std::uint64_t hold = 0;           // of the last OwnerPong
  bool looked_at = false;
  Status refused;

  std::optional<std::uint32_t> begun;  // of the thread of Begin and Commit

  // Of the thread:
  Socket socket;
  Epoch epoch = 0;  // 0: not known to the coordinator
  Time heard, next_send = {};
  Duration heartbeat = kRegisterAgain, timeout = {};
  std::optional<Time> refused_since;  // with Unavailable, and not taken since
  std::uint64_t told = 0;             // time
  std::jthread thread;                // last member: ends first
};

void VolumeOwner::Impl::Forget() {
  epoch = told = 0;
  next_send = {};
  Tell([this] {
    used.clear();
    hold = 0;
    looked_at = false;
  });
}

void VolumeOwner::Impl::Hear(CoordinatorToOwner message, Time now) {
  heard = now;
  std::visit(Overloaded{[&](const OwnerWelcome& m) {
                          if (m.incarnation != registration.incarnation) return;
                          epoch = m.epoch;
                          refused_since.reset();
                          heartbeat = std::chrono::milliseconds(m.heartbeat_ms);
                          timeout = std::chrono::milliseconds(m.timeout_ms);
                          next_send = now;
                        },
                        [&](OwnerPong& m) {
                          if (m.epoch != epoch) return;
                          std::ranges::sort(m.used);
                          if (m.hold != hold) next_send = now;
                          Tell([&] {
                            used = std::move(m.used);
                            hold = m.hold;
                            looked_at = m.looked_at;
                          });
                        },
                        [&](const OwnerSteered& m) {
                          if (m.epoch != epoch || m.values.size() != registration.steered.size()) return;
                          Tell([&] {
                            for (std::size_t i = 0; i < m.values.size(); ++i) registration.steered[i].value = m.values[i];
                          });
                        },
                        [&](const OwnerRefused& m) {
                          if (m.incarnation != registration.incarnation) return;
                          if (!refused_since) refused_since = now;
                          if (m.status.code() == StatusCode::kUnavailable && now < *refused_since + kOthersLeave) return;
                          Tell([&] { refused = m.status; });
                        },
                        [&](const Retire&) {
                          if (epoch != 0) Forget();
                        },
                        [&](const ChunkRequest& m) {
                          if (m.epoch == epoch) Answer(m);
                        }},
             message);
}

void VolumeOwner::Impl::Answer(const ChunkRequest& request) {
  const Box& box = request.box;
  const std::size_t sample_bytes = BytesPerSample(layout.samples);
  const auto of = std::ranges::find_if(layout.boxes, [&](const HeldBox& each) { return !box.empty() && each.box.Contains(box); });
  std::vector<std::byte> samples;
  Status status = Status::InvalidArgument("no box of this owner has these voxels");
  const int level = int(request.level);
  const Box points = {{}, PointsAlong(box.size(), level)};
  if (of != layout.boxes.end() && request.chunk == 0 && std::size_t(points.voxel_count()) <= kMostAskedBytes / sample_bytes) {
    samples.resize(std::size_t(points.voxel_count()) * sample_bytes);
    status = own->Read(std::size_t(of - layout.boxes.begin()), box, level, request.dataset, BoxRoom::Dense(points, samples.data(), true));
  }
  if (!status.ok()) return Send(ChunkRefused{epoch, request.dataset, box, request.chunk, status});
  Chunk chunk{.epoch = epoch, .dataset = request.dataset, .box = box, .chunk = request.chunk};
  const Bytes payload = PackChunk(Bytes(std::move(samples)), Codec::kRaw, chunk);
  Send(chunk, payload);
}

void VolumeOwner::Impl::Run(const std::stop_token& stop) {
  const std::array<Socket*, 1> sockets = {&socket};
  bool ended = false;  // it was refused
  while (!stop.stop_requested() && !ended) {
    const Status done = Guarded("an owner of voxels", [&] {
      Wait(sockets, &wakeup, std::clamp(next_send - MonotonicNow(), Duration::zero(), heartbeat));
      while (const std::optional<Incoming> incoming = socket.TryReceive()) {
        Result<CoordinatorToOwner> message = Decode<CoordinatorToOwner>(incoming->header(), incoming->payload().size());
        if (message.ok()) Hear(*std::move(message), MonotonicNow());
      }
      if (socket.refused()) Tell([this] { refused = Status::Unavailable("the coordinator refuses the key of this owner"); });
      const Time now = MonotonicNow();
      if (epoch != 0 && now >= heard + timeout) Forget();
      OwnerTime time{.epoch = epoch};
      OwnerPing ping{.epoch = epoch};
      {
        const std::lock_guard lock(mutex);
        ended = !refused.ok();
        if (ended) return;
        time.time = latest;
        time.simulated = simulated;
        ping.hold = hold;
        ping.gone = gone;
      }
      if (epoch != 0 && time.time > std::exchange(told, time.time)) Send(time);
      if (now < next_send) return;
      next_send = now + heartbeat;
      epoch != 0 ? Send(ping) : Send(registration);
    });
    if (!done.ok()) Tell([&] { refused = done; });
  }
  if (epoch != 0) Send(OwnerLeave{epoch});
}

std::optional<std::uint32_t> VolumeOwner::Impl::FreeSlot() const {
  std::optional<std::uint32_t> oldest;
  for (std::uint32_t slot = 0; slot < layout.slots; ++slot) {
    const std::uint64_t time = times.at(slot);
    const bool in_use = std::ranges::binary_search(used, time) || (hold != 0 && !used.empty() && time > used.back());
    // Not the latest one: the simulation may compute the next time from it.
    if (time != 0 && (time == latest || in_use)) continue;
    if (!oldest || time < times.at(*oldest)) oldest = slot;
  }
  return oldest;
}

Result<std::unique_ptr<VolumeOwner>> VolumeOwner::Start(Context& context, VolumeOwnerOptions options) {
  SocketOptions socket_options;
  if (!options.service_file.empty()) {
    const Result<ServiceFile> file = ReadServiceFile(options.service_file);
    if (!file.ok()) return file.status();
    if (file->role != Role::kOwner) {
      return Status::InvalidArgument(
          fmt::format("service file '{}' is of role {}, but owner is needed here", options.service_file, NameOf(file->role)));
    }
    options.endpoint = file->endpoint;
    socket_options.client_keys = file->keys();
  }
  if (options.owner >= options.owners || options.owners > kMostOwners) {
    return Status::InvalidArgument(
        fmt::format("owner {} of {}: must be below it, and there are at most {}", options.owner, options.owners, kMostOwners));
  }
  OwnerLayout& layout = options.layout;
  if (layout.slots < 2)
    return Status::InvalidArgument(fmt::format("{} slots of an owner, must be in [2, {}]", layout.slots, kMostOwnerSlots));
  layout.size = options.description.geometry.size;
  options.description.type = KeptTypeOf(layout.samples).type;
  std::random_device device;
  RegisterOwner as{.incarnation = (Incarnation{device()} << 32) | device() | 1,
                   .dataset = std::move(options.dataset),
                   .owner = options.owner,
                   .owners = options.owners,
                   .description = options.description,
                   .samples = std::string(ToString(layout.samples)),
                   .steered = std::move(options.parameters)};
  for (const HeldBox& each : layout.boxes) as.boxes.push_back(each.box);
  Result<std::shared_ptr<OwnerMemory>> memory = OwnerMemory::Create(as.incarnation, layout);
  if (!memory.ok()) return memory.status();
  // The coordinator would drop what it cannot decode.
  if (const auto checked = Decode(Encode(as)); !checked.ok()) return checked.status();
  as.pid = std::uint32_t(::getpid());
  as.file_descriptor = (*memory)->file_descriptor();
  const Result<std::shared_ptr<const MappedOwner>> own =
      MappedOwner::Open({SharedMemoryScope(), as.pid, as.file_descriptor, as.incarnation});
  if (!own.ok()) return own.status();
  if (options.share_memory) as.memory_scope = SharedMemoryScope();
  Result<Socket> socket = Socket::Dealer(context, socket_options);
  if (!socket.ok()) return socket.status();
  if (Status connected = socket->Connect(options.endpoint); !connected.ok()) return connected;
  auto impl = std::make_unique<Impl>(std::move(as), std::move(layout), *std::move(memory), *own, *std::move(socket));
  return std::unique_ptr<VolumeOwner>(new VolumeOwner(std::move(impl)));
}

VolumeOwner::VolumeOwner(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}

VolumeOwner::~VolumeOwner() {
  impl_->thread.request_stop();
  impl_->wakeup.Notify();
}

Result<VolumeOwner::Slot> VolumeOwner::Begin(Duration timeout) {
  const Time since = MonotonicNow();
  std::unique_lock lock(impl_->mutex);
  std::optional<std::uint32_t> slot;
  impl_->changed.wait_until(lock, since + timeout, [&] { return !impl_->refused.ok() || (slot = impl_->FreeSlot()).has_value(); });
  if (!impl_->refused.ok()) return impl_->refused;
  if (!slot)
    return Status::Unavailable(fmt::format("\"{}\": the times of all {} slots are used", impl_->registration.dataset, impl_->layout.slots));
  impl_->begun = slot;
  const std::uint64_t freed = std::exchange(impl_->times.at(*slot), 0);
  impl_->gone = std::max(impl_->gone, freed);
  return Slot{impl_->memory->Begin(*slot), MonotonicNow() - since, freed};
}

Status VolumeOwner::Commit(std::uint64_t time, double simulated, std::span<const std::byte* const> arrays) {
  if (!impl_->begun) return Status::InvalidArgument("Commit without Begin");
  if (time <= impl_->latest) return Status::InvalidArgument(fmt::format("time {} is not above {}, the last one", time, impl_->latest));
  if (const std::size_t boxes = impl_->layout.boxes.size(); !arrays.empty() && arrays.size() != boxes) {
    return Status::InvalidArgument(fmt::format("arrays of {} boxes, must be of {}", arrays.size(), boxes));
  }
  impl_->memory->Commit(*impl_->begun, time, simulated, arrays);
  impl_->Tell([&] {
    impl_->times.at(*impl_->begun) = impl_->latest = time;
    impl_->simulated = simulated;
  });
  impl_->begun.reset();
  impl_->wakeup.Notify();
  return Status::Ok();
}

std::vector<double> VolumeOwner::parameters() const {
  const std::lock_guard lock(impl_->mutex);
  std::vector<double> values;
  for (const SteeredParameter& each : impl_->registration.steered) values.push_back(each.value);
  return values;
}

bool VolumeOwner::looked_at() const {
  const std::lock_guard lock(impl_->mutex);
  return impl_->looked_at;
}

}  // namespace slabstream
