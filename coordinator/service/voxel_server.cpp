#include "coordinator/service/voxel_server.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <variant>

#include "common/base/log.h"
#include "common/memory/pooled_vector.h"
#include "common/threads/guarded.h"
#include "common/volume/light_volume.h"
#include "common/volume/memory_budget.h"
#include "common/wire/payload.h"
#include "coordinator/service/box_samples.h"
#include "data/sources/read_part.h"

namespace slabstream {
namespace {

std::string Text(const Box& box) {
  return fmt::format("[{}, {}) x [{}, {}) x [{}, {})", box.begin.x, box.end.x, box.begin.y, box.end.y, box.begin.z, box.end.z);
}

// What this process lacks, no worker lacks: another one would get the same answer, and the same one may get a better answer later.
Status AsWorkersSee(const Status& failure) {
  if (failure.code() != StatusCode::kResourceExhausted && failure.code() != StatusCode::kInternal) return failure;
  return Status::Unavailable("the coordinator cannot send voxels: " + failure.message());
}

}  // namespace

Result<std::unique_ptr<VoxelServer>> VoxelServer::Start(Context& context, const Place& place, Epoch epoch, Codec codec) {
  SocketOptions options = place.socket;
  options.send_high_water_mark = kMaxQueuedChunks;
  Result<Socket> socket = Socket::Router(context, options);
  if (!socket.ok()) return socket.status();
  Result<std::string> bound = socket->Bind(place.endpoint);
  if (!bound.ok()) return bound.status();
  return std::unique_ptr<VoxelServer>(new VoxelServer(std::move(*socket), std::move(*bound), epoch, codec));
}

VoxelServer::VoxelServer(Socket socket, std::string endpoint, Epoch epoch, Codec codec)
    : endpoint_(std::move(endpoint)),
      epoch_(epoch),
      codec_(codec),
      socket_(std::move(socket)),
      thread_([this](const std::stop_token& stop) { Run(stop); }) {}

VoxelServer::~VoxelServer() {
  thread_.request_stop();
  read_->wakeup().Notify();
  thread_.join();
}

void VoxelServer::Publish(DatasetId dataset, Samples samples) {
  const std::lock_guard lock(mutex_);
  if (samples.description) {
    light_volumes_[LightVolumeOf(dataset)] = std::make_shared<const LazyVolume>([samples] {
      return samples.volume != nullptr ? MakeLightVolume(samples.volume->block, *samples.description)
                                       : MakeLightVolume(*samples.bricks, *samples.description);
    });
  }
  samples_.insert_or_assign(dataset, std::move(samples));
}

void VoxelServer::Withdraw(DatasetId dataset) {
  decltype(samples_)::node_type unused;  // freed without the lock
  decltype(light_volumes_)::node_type unused_light;
  const std::lock_guard lock(mutex_);
  unused = samples_.extract(dataset);
  unused_light = light_volumes_.extract(LightVolumeOf(dataset));
}

VoxelServer::Samples VoxelServer::Find(DatasetId dataset) {
  const std::lock_guard lock(mutex_);
  const auto found = samples_.find(dataset);
  return found == samples_.end() ? Samples{} : found->second;
}

std::shared_ptr<const LazyVolume> VoxelServer::FindLight(DatasetId light) {
  const std::lock_guard lock(mutex_);
  const auto found = light_volumes_.find(light);
  return found == light_volumes_.end() ? nullptr : found->second;
}

std::shared_ptr<const HeldVoxels> VoxelServer::FindHeld(DatasetId dataset) {
  if (const auto light = FindLight(dataset)) return std::make_shared<const HeldVoxels>(HeldVoxels{light});
  const Samples samples = Find(dataset);
  if (samples.volume != nullptr) return std::make_shared<const HeldVoxels>(HeldVoxels{samples.volume, samples.read_from});
  if (samples.bricks != nullptr) return std::make_shared<const HeldVoxels>(HeldVoxels{samples.bricks, samples.read_from});
  return nullptr;
}

void VoxelServer::EndConnections(const std::string& user) {
  {
    const std::lock_guard lock(mutex_);
    unwanted_.push_back(user);
  }
  read_->wakeup().Notify();
}

std::vector<std::string> VoxelServer::TakeUnwanted() {
  const std::lock_guard lock(mutex_);
  return std::exchange(unwanted_, {});
}

Bytes VoxelServer::Cut(const Samples& samples, const Box& box, const ChunkPart& part) {
  if (samples.volume != nullptr) return BoxSamples(samples.volume, box, part.begin, part.begin + part.bytes);
  UnwrittenVector<std::byte> cut(part.bytes);
  VoxelBricks(*samples.bricks).Read(box, part.begin, cut);
  return Bytes(std::move(cut));
}

void VoxelServer::AnswerCells(Asked asked, std::shared_ptr<const GridCells> cells) {
  const Box box = asked.request.box;
  kept_cells_.DropIf([](const auto& entry) { return entry.value.of.expired(); });
  if (const KeptCells* found = kept_cells_.Find({cells.get(), box})) return ReplyCells(asked, found->bytes);
  std::vector<Asked>& waiting = awaits_cells_[{cells.get(), box}];
  if (std::ranges::any_of(waiting, [&](const Asked& other) { return other.IsSame(asked); })) return;
  waiting.push_back(asked);
  if (waiting.size() > 1) return;
  const Status begun = Guarded("cells of a box", [&] {
    cuts_.Post(asked.request.dataset, [inbox = read_, cells, box] {
      auto cut = Guarded("cells of a box", [&]() -> Result<Bytes> {
        const Result<Mesh> part = cells->CellsIn(box);
        return part.ok() ? Result(Bytes(EncodeMesh(*part))) : part.status();
      });
      inbox->Post(CellsCut{cells, box, std::move(cut)});
    });
  });
  if (begun.ok()) return;
  awaits_cells_.erase({cells.get(), box});
  Reply(asked.identity, asked.request, begun);
}

void VoxelServer::OnCut(CellsCut cut) {
  const auto waiting = awaits_cells_.extract({cut.of.get(), cut.box});
  if (cut.bytes.ok()) {
    kept_cells_.Put({cut.of.get(), cut.box}, {cut.of, *cut.bytes}, cut.bytes->size());
    const auto room = std::uint64_t(std::max<std::int64_t>(AvailableMemoryBytes(), 0));
    kept_cells_.DropBeyond(std::min<std::uint64_t>(kMostKept, room / 2));
  }
  for (const Asked& asked : waiting.mapped()) {
    if (cut.bytes.ok()) {
      ReplyCells(asked, *cut.bytes);
    } else {
      Reply(asked.identity, asked.request, cut.bytes.status());
    }
  }
}

void VoxelServer::ReplyCells(const Asked& asked, const Bytes& cells) {
  const ChunkRequest& request = asked.request;
  Reply(asked.identity, request, Guarded("a chunk of cells", [&]() -> Result<std::pair<Chunk, Bytes>> {
          const std::uint64_t begin = BeginOfCellChunk(request.chunk);
          if (begin >= cells.size()) {
            return Status::InvalidArgument(fmt::format("chunk request: chunk {} of cells is not below {}", request.chunk - kFirstCellChunk,
                                                       CellChunkCount(cells.size())));
          }
          Chunk chunk{.epoch = epoch_, .dataset = request.dataset, .box = request.box, .chunk = request.chunk};
          chunk.cell_bytes = cells.size();
          const auto owner = std::make_shared<const Bytes>(cells);
          Bytes part(owner, cells.span().subspan(begin, BytesOfCellChunk(cells.size(), request.chunk)));
          Bytes payload = PackChunk(std::move(part), codec_, chunk);
          return std::pair(chunk, std::move(payload));
        }));
}

Status VoxelServer::Check(const ChunkRequest& request, const Samples& samples) {
  if (!samples.any()) return Status::NotFound(fmt::format("chunk request: no dataset {}", request.dataset));
  if (request.box.empty() || !samples.box().Contains(request.box)) {
    return Status::InvalidArgument(
        fmt::format("chunk request: box {} is not inside the volume {}", Text(request.box), Text(samples.box())));
  }
  if (IsCellChunk(request.chunk)) {
    return samples.cells != nullptr ? Status::Ok() : Status::InvalidArgument("chunk request: cells of a dataset that has none");
  }
  if (const std::uint32_t count = ChunkCount(request.box, samples.types().samples); request.chunk >= count) {
    return Status::InvalidArgument(fmt::format("chunk request: chunk {} is not below {}", request.chunk, count));
  }
  return Status::Ok();
}

void VoxelServer::Run(const std::stop_token& stop) {
  const std::array<Socket*, 1> sockets = {&socket_};
  const auto guarded = [this](auto&& work) {
    const Status done = Guarded("voxels plane", work);
    if (!done.ok()) complaints_.Warning(done.message());  // the worker asks again when its request times out
  };
  while (!stop.stop_requested()) {
    guarded([&] {
      Wait(sockets, &read_->wakeup(), std::chrono::minutes(1));
      for (const std::string& user : TakeUnwanted()) socket_.EndConnections(user);
      for (Done& done : read_->TakeAll()) {
        if (auto* const cut = std::get_if<CellsCut>(&done)) {
          guarded([&] { OnCut(std::move(*cut)); });
          continue;
        }
        if (auto* const made = std::get_if<Made>(&done)) {
          guarded([&] { OnMade(std::move(*made)); });
          continue;
        }
        auto& read = std::get<ReadDone>(done);
        --reads_.at(read.asked->request.dataset).begun;
        guarded([&] { Reply(read.asked->identity, read.asked->request, std::move(read.answer)); });
        guarded([&] { ReadNext(read.asked->request.dataset); });
      }
      while (!stop.stop_requested()) {
        const std::optional<Incoming> incoming = socket_.TryReceive();
        if (!incoming) break;
        guarded([&] { Answer(*incoming); });
      }
    });
  }
}

void VoxelServer::Answer(const Incoming& incoming) {
  const Result<WorkerToVoxels> decoded = Decode<WorkerToVoxels>(incoming.header(), incoming.payload().size());
  if (!decoded.ok()) return complaints_.Warning("voxels plane: dropped a message: " + decoded.status().message());
  const ChunkRequest& request = std::get<ChunkRequest>(*decoded);
  if (request.epoch != epoch_) return;  // it was for an earlier coordinator; a refusal would meet the worker's next request
  Samples samples = Find(request.dataset);
  if (const auto light = FindLight(request.dataset)) {
    const Status made = Guarded("a light volume", [&] {
      samples.volume = {light, &light->Get()};
      return Status::Ok();
    });
    if (!made.ok()) return Reply(incoming.identity, request, made);
  }
  if (const Status status = Check(request, samples); !status.ok()) return Reply(incoming.identity, request, status);
  if (samples.in_parts.source != nullptr) {
    const Asked asked = {incoming.identity, request, samples.in_parts};
    if (samples.in_parts.source->info().on_demand) return MakeFirst(asked);
    std::deque<Asked>& waiting = reads_[request.dataset].waiting;
    if (std::ranges::none_of(waiting, [&](const Asked& other) { return other.IsSame(asked); })) waiting.push_back(asked);
    return ReadNext(request.dataset);
  }
  if (IsCellChunk(request.chunk)) return AnswerCells({incoming.identity, request}, samples.cells);
  Reply(incoming.identity, request, Guarded("chunk request", [&]() -> Result<std::pair<Chunk, Bytes>> {
          Chunk chunk{.epoch = epoch_, .dataset = request.dataset, .box = request.box, .chunk = request.chunk};
          if (samples.read_from != nullptr) chunk.stored_bytes = samples.read_from->TakeStoredBytes();
          Bytes cut = Cut(samples, request.box, PartOfChunk(request.box, samples.types().samples, request.chunk));
          Bytes payload = PackChunk(std::move(cut), codec_, chunk);
          return std::pair(chunk, std::move(payload));
        }));
}

void VoxelServer::MakeFirst(Asked asked) {
  std::vector<Asked>& waiting = reads_[asked.request.dataset].awaits_making;
  if (std::ranges::any_of(waiting, [&](const Asked& other) { return other.IsSame(asked); })) return;
  waiting.push_back(asked);
  const Status begun = Guarded("a chunk of voxels", [&] {
    asked.from.source->Make(asked.request.box, [inbox = read_, asked](Status status) { inbox->Post(Made{asked, std::move(status)}); });
    return Status::Ok();
  });
  if (!begun.ok()) OnMade({std::move(asked), begun});
}

void VoxelServer::OnMade(Made made) {
  const ChunkRequest& request = made.asked.request;
  Reads& reads = reads_[request.dataset];
  std::erase_if(reads.awaits_making, [&](const Asked& each) { return each.IsSame(made.asked); });
  if (made.status.ok() && !request.in_place) {
    reads.waiting.push_back(made.asked);
  } else if (made.status.ok()) {
    Chunk chunk{.epoch = epoch_, .dataset = request.dataset, .box = request.box, .chunk = request.chunk};
    Bytes none = PackChunk(Bytes(), Codec::kRaw, chunk);
    Reply(made.asked.identity, request, std::pair(chunk, std::move(none)));
  } else {
    Reply(made.asked.identity, request, made.status);
  }
  ReadNext(request.dataset);
}

void VoxelServer::ReadNext(DatasetId dataset) {
  Reads& reads = reads_.at(dataset);
  while (!reads.waiting.empty() && reads.begun < kReadAtOnce) {
    const auto asked = std::make_shared<const Asked>(std::move(reads.waiting.front()));
    reads.waiting.pop_front();
    ++reads.begun;
    const ChunkRequest& request = asked->request;
    const ChunkPart part = PartOfChunk(request.box, asked->from.description().type, request.chunk);
    const auto done = [inbox = read_, codec = codec_, epoch = epoch_, asked](Result<Bytes> samples) {
      const ChunkRequest& of = asked->request;
      auto answer = Guarded("a chunk of voxels", [&]() -> Result<std::pair<Chunk, Bytes>> {
        if (!samples.ok()) return samples.status();
        Chunk chunk{.epoch = epoch, .dataset = of.dataset, .box = of.box, .chunk = of.chunk};
        chunk.stored_bytes = asked->from.source->TakeStoredBytes();
        Bytes payload = PackChunk(*std::move(samples), codec, chunk);
        return std::pair(chunk, std::move(payload));
      });
      inbox->Post(ReadDone{asked, std::move(answer)});
    };
    const Status begun =
        Guarded("a chunk of voxels", [&] { ReadPart(asked->from.source, asked->from.level, request.box, part.begin, part.bytes, done); });
    if (begun.ok()) continue;
    --reads.begun;  // its place is free again
    Reply(asked->identity, request, begun);
  }
  if (reads.awaits_making.empty() && reads.waiting.empty() && reads.begun == 0) reads_.erase(dataset);
}

void VoxelServer::Reply(const std::string& identity, const ChunkRequest& request, Result<std::pair<Chunk, Bytes>> answer) {
  if (answer.ok()) {
    const Status sent = socket_.Send(identity, Encode(answer->first), answer->second);
    if (!sent.ok()) LogDebug("voxels plane: " + sent.message());  // it has gone, or asks again when its request times out
    return;
  }
  complaints_.Warning(answer.status().message());
  const ChunkRefused refused{epoch_, request.dataset, request.box, request.chunk, AsWorkersSee(answer.status())};
  (void)socket_.Send(identity, Encode(refused));  // a worker that has gone needs no refusal
}

}  // namespace slabstream
