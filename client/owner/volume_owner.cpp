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

#include "client/owner/owner_machine.h"
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

}  // namespace

struct VolumeOwner::Impl {
  Impl(RegisterOwner as, OwnerLayout of_layout, std::shared_ptr<OwnerMemory> of_owner, std::shared_ptr<const MappedOwner> mapped,
       MakeBox make, std::uint64_t made_bytes, Socket to_coordinator)
      : layout(std::move(of_layout)),
        memory(std::move(of_owner)),
        own(std::move(mapped)),
        maker(make == nullptr ? nullptr
                              : std::make_unique<BoxMaker>(memory, own, made_bytes, std::move(make), [this] { wakeup.Notify(); })),
        machine(std::move(as), layout.slots),
        socket(std::move(to_coordinator)),
        thread([this](const std::stop_token& stop) { Run(stop); }) {}

  void Run(const std::stop_token& stop);
  void Answer(const ChunkRequest& request);
  void Answer(const ChunkRequest& request, Result<Bytes> samples);
  void Send(MessageView message, const Bytes& payload = {}) { (void)socket.Send({}, Encode(message), payload); }
  auto Do(const auto& work) {
    const std::lock_guard lock(mutex);
    changed.notify_all();
    return work();
  }

  const OwnerLayout layout;
  const std::shared_ptr<OwnerMemory> memory;
  const std::shared_ptr<const MappedOwner> own;  // the same memory, to be read while it is written
  Wakeup wakeup;
  const std::unique_ptr<BoxMaker> maker;  // null: boxes are not made on demand

  mutable std::mutex mutex;
  std::condition_variable changed;
  OwnerMachine machine;  // guarded by mutex

  std::optional<std::uint32_t> begun;  // of the thread of Begin and Commit

  // Of the thread:
  Socket socket;
  std::jthread thread;  // last member: ends first
};

void VolumeOwner::Impl::Answer(const ChunkRequest& request) {
  const Box& box = request.box;
  const std::size_t sample_bytes = BytesPerSample(layout.samples);
  const auto of = std::ranges::find_if(layout.boxes, [&](const HeldBox& each) { return !box.empty() && each.box.Contains(box); });
  const int level = int(request.level);
  const Box points = {{}, PointsAlong(box.size(), level)};
  const bool fits = std::size_t(points.voxel_count()) <= kMostAskedBytes / sample_bytes || (maker != nullptr && request.in_place);
  if (of == layout.boxes.end() || request.chunk != 0 || !fits || (maker != nullptr && level != 0)) {
    return Answer(request, Status::InvalidArgument("no box of this owner has these voxels"));
  }
  const auto number = std::size_t(of - layout.boxes.begin());
  if (maker != nullptr) return maker->Ask(number, request);
  std::vector<std::byte> samples(std::size_t(points.voxel_count()) * sample_bytes);
  const Status read = own->Read(number, box, level, request.dataset, BoxRoom::Dense(points, samples.data(), true));
  Answer(request, read.ok() ? Result(Bytes(std::move(samples))) : read);
}

void VolumeOwner::Impl::Answer(const ChunkRequest& request, Result<Bytes> samples) {
  if (!samples.ok()) return Send(ChunkRefused{request.epoch, request.dataset, request.box, request.chunk, samples.status()});
  Chunk chunk{.epoch = request.epoch, .dataset = request.dataset, .box = request.box, .chunk = request.chunk};
  const Bytes payload = PackChunk(*std::move(samples), Codec::kRaw, chunk);
  Send(chunk, payload);
}

void VolumeOwner::Impl::Run(const std::stop_token& stop) {
  const std::array<Socket*, 1> sockets = {&socket};
  Epoch epoch = 0;
  Duration rest = {};
  bool ended = false;  // it was refused
  while (!stop.stop_requested() && !ended) {
    const Status done = Guarded("an owner of voxels", [&] {
      Wait(sockets, &wakeup, rest);
      while (const std::optional<Incoming> incoming = socket.TryReceive()) {
        Result<CoordinatorToOwner> message = Decode<CoordinatorToOwner>(incoming->header(), incoming->payload().size());
        if (!message.ok()) continue;
        epoch = Do([&] {
          machine.Hear(*message, MonotonicNow());
          return machine.epoch();
        });
        if (const auto* request = std::get_if<ChunkRequest>(&*message); request != nullptr && request->epoch == epoch) Answer(*request);
      }
      for (BoxMaker::Answer& each : maker == nullptr ? std::vector<BoxMaker::Answer>() : maker->TakeAnswers()) {
        if (each.request.epoch == epoch) Answer(each.request, std::move(each.samples));  // else another coordinator has asked
      }
      if (socket.refused()) Do([this] { machine.Refuse(Status::Unavailable("the coordinator refuses the key of this owner")); });
      const bool making = maker != nullptr && maker->is_making();
      const std::vector<OwnerToCoordinator> said = Do([&] {
        const Time now = MonotonicNow();
        std::vector<OwnerToCoordinator> words = machine.Say(now, making);
        epoch = machine.epoch();
        rest = std::clamp(machine.NextWake() - now, Duration::zero(), machine.heartbeat());
        ended = !machine.refused().ok();
        return words;
      });
      for (const OwnerToCoordinator& message : said) std::visit([this](const auto& each) { Send(each); }, message);
    });
    if (!done.ok()) Do([&] { machine.Refuse(done); });
  }
  if (epoch != 0) Send(OwnerLeave{epoch});
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
                   .steered = std::move(options.parameters),
                   .on_demand = options.make != nullptr,
                   .fields = std::move(options.fields),
                   .field = options.field};
  layout.on_demand = as.on_demand;
  if (layout.on_demand) layout.slot_bytes = 0;
  for (HeldBox& each : layout.boxes) {
    if (layout.on_demand) each.offset = 0;
    as.boxes.push_back(each.box);
  }
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
  auto impl = std::make_unique<Impl>(std::move(as), std::move(layout), *std::move(memory), *own, std::move(options.make),
                                     options.made_bytes, *std::move(socket));
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
  OwnerMachine& machine = impl_->machine;
  std::optional<std::uint32_t> slot;
  impl_->changed.wait_until(lock, since + timeout, [&] { return !machine.refused().ok() || (slot = machine.FreeSlot()).has_value(); });
  if (!machine.refused().ok()) return machine.refused();
  if (!slot) {
    return Status::Unavailable(
        fmt::format("\"{}\": the times of all {} slots are used", machine.registration().dataset, impl_->layout.slots));
  }
  impl_->begun = slot;
  const std::uint64_t freed = machine.Begin(*slot);
  if (impl_->maker != nullptr) impl_->maker->SetTime(*slot, 0);
  return Slot{impl_->memory->Begin(*slot), MonotonicNow() - since, freed};
}

Status VolumeOwner::Commit(std::uint64_t time, double simulated, std::span<const std::byte* const> arrays) {
  if (!impl_->begun) return Status::InvalidArgument("Commit without Begin");
  if (const std::uint64_t latest = impl_->machine.latest(); time <= latest) {  // no other thread commits
    return Status::InvalidArgument(fmt::format("time {} is not above {}, the last one", time, latest));
  }
  if (const std::size_t boxes = impl_->layout.boxes.size(); !arrays.empty() && arrays.size() != boxes) {
    return Status::InvalidArgument(fmt::format("arrays of {} boxes, must be of {}", arrays.size(), boxes));
  }
  if (impl_->maker != nullptr && !arrays.empty()) return Status::InvalidArgument("arrays of boxes that are made on demand");
  impl_->memory->Commit(*impl_->begun, time, simulated, arrays);
  if (impl_->maker != nullptr) impl_->maker->SetTime(*impl_->begun, time);
  impl_->Do([&] { impl_->machine.Commit(*impl_->begun, time, simulated); });
  impl_->begun.reset();
  impl_->wakeup.Notify();
  return Status::Ok();
}

std::vector<double> VolumeOwner::parameters() const {
  const std::lock_guard lock(impl_->mutex);
  std::vector<double> values;
  for (const SteeredParameter& each : impl_->machine.registration().steered) values.push_back(each.value);
  return values;
}

bool VolumeOwner::looked_at() const {
  const std::lock_guard lock(impl_->mutex);
  return impl_->machine.looked_at();
}

}  // namespace slabstream
