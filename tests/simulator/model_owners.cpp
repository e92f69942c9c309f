#include "tests/simulator/model_owners.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <future>
#include <limits>
#include <span>

#include "common/wire/payload.h"
#include "coordinator/service/dataset_id.h"
#include "data/sources/read_part.h"
#include "tests/common/decomposition/random_partition.h"
#include "tests/simulator/simulation.h"

namespace slabstream {
namespace {

using std::chrono::seconds;
using testing::HasSubstr;

constexpr char kField[] = "volume";
constexpr int kOwnerEnds = 1 << 21;

// Whole numbers that float32 has.
float ValueOf(std::uint64_t time, std::uint64_t incarnation) {
  return float(1 + ((time * 0x9e3779b97f4a7c15U ^ incarnation) * 0xd1342543de82ef95U >> 42U));
}

void CheckError(const Status& status) {
  EXPECT_THAT(status.message(), HasSubstr(std::string("\"") + kField + "\""));
  EXPECT_EQ(status.message().find('\n'), std::string::npos) << status.message();
}

}  // namespace

ModelOwners::ModelOwners(SimulatedService& service, Random& random, const Faults& faults, FaultyNetwork& network,
                         const VolumeSummary& volume, Tally& tally, TellDatasets tell)
    : service_(service),
      random_(random),
      faults_(faults),
      network_(network),
      volume_(volume),
      tally_(tally),
      tell_(std::move(tell)),
      calm_(faults.none() || (random.Chance(0.15) && faults.coordinator_pauses + faults.suspensions + faults.clock_jumps == 0)),
      orderly_(faults.lose + faults.duplicate == 0 && !faults.reorder),
      count_(random.Integer(1U, 5U)),
      drift_(random.Chance(0.3) ? random.Integer<std::uint64_t>(6, 40) : random.Integer<std::uint64_t>(1, 5)),
      boxes_(count_),
      context_(std::make_shared<ReadContext>(ReadContext::Limits{.decode_threads = 1})) {
  const Partition partition = RandomPartition(random, volume.description.geometry.bounds(), random.Integer(int(count_), 30));
  std::uint32_t next = 0;
  for (const Box& box : partition.boxes()) {
    boxes_[next < count_ ? next : random.Integer(0U, count_ - 1)].push_back(box);
    ++next;
  }
}

// ---------------------------------------------------------------- the world

void ModelOwners::PlanTroubles(Duration span) {
  const auto somewhere = [&](int times, const std::function<void()>& what) {
    for (int i = 0; i < times; ++i) {
      service_.queue().After(Duration(random_.Integer<std::int64_t>(0, span.count())), [this, what] {
        if (!healed_) what();
      });
    }
  };
  for (std::uint32_t number = 0; number < count_; ++number) {
    if (!calm_ && random_.Chance(0.1)) continue;  // it comes later
    service_.queue().After(std::chrono::milliseconds(random_.Integer(0, 100)), [this, number] { Spawn(Registration(number), false); });
  }
  service_.queue().After(seconds(2), [this] { Supervise(); });
  somewhere(random_.Integer(0, 6), [this] { Steer(); });
  if (calm_) return;
  const auto to_some = [this](Count count, const auto& what) {
    return [this, count, what] {
      Process* const process = SomeOwner();
      if (process == nullptr) return;
      tally_.Add(count);
      what(*process);
    };
  };
  somewhere(random_.Integer(0, 3), to_some(Count::kOwnersKilled, [this](Process& process) { End(process, random_.Chance(0.5)); }));
  somewhere(random_.Integer(0, 2), to_some(Count::kOwnersLeft, [this](Process& process) {
              if (process.machine.epoch() != 0) Send(process, OwnerLeave{process.machine.epoch()}, {});
              End(process, true);
            }));
  somewhere(random_.Integer(0, 2), to_some(Count::kOwnersReconnected, [this](Process& process) { Connect(process); }));
  somewhere(random_.Integer(0, 3), to_some(Count::kOwnersStalled, [this](Process& process) {
              process.stalled = service_.now() + random_.Real(0.5, 15);
              AtProcess(process, process.stalled, [this, &process] { TryBegin(process); });
            }));
  somewhere(random_.Integer(0, 2), to_some(Count::kOwnersPaused, [this](Process& process) {
              process.held = std::max(process.held, service_.now() + random_.Real(0.1, 8));  // what waits keeps its order
            }));
  somewhere(random_.Integer(0, 2), [this] { SpawnStranger(); });
  if (random_.Chance(0.15)) {
    somewhere(1, [this] {
      for (Process& process : processes_) {
        if (process.alive) End(process, random_.Chance(0.5));
      }
    });
  }
}

void ModelOwners::Heal() {
  healed_ = true;
  for (Process& process : processes_) {
    if (!process.alive) continue;
    if (process.stranger) End(process, false);
    process.stalled = 0;
    TryBegin(process);
  }
}

void ModelOwners::LeaveAll() {
  left_ = true;
  for (Process& process : processes_) {
    if (!process.alive) continue;
    const bool silently = random_.Chance(0.5);
    if (!silently && process.machine.epoch() != 0) Send(process, OwnerLeave{process.machine.epoch()}, {});
    End(process, silently);
  }
}

// ---------------------------------------------------------------- owners

RegisterOwner ModelOwners::Registration(std::uint32_t number) {
  RegisterOwner as{.incarnation = random_.Integer<std::uint64_t>(1, std::uint64_t{1} << 62),
                   .dataset = kField,
                   .owner = number,
                   .owners = count_,
                   .description = volume_.description,
                   .samples = "float32",
                   .boxes = boxes_[number]};
  if (number == 0) as.steered = {{"feed", 0, random_.Chance(0.5) ? 1 : 0.5, 0.25}, {"kill", -1, 1, 0}};
  return as;
}

void ModelOwners::Spawn(const RegisterOwner& as, bool stranger) {
  const std::uint32_t slots = random_.Integer(2U, 4U);
  const std::uint64_t time = stranger ? 0 : Slowest();
  Process& process = processes_.emplace_back(
      Process{.machine = OwnerMachine(as, slots), .stranger = stranger, .step = random_.Real(0.05, 0.5), .time = time});
  tally_.Add(Count::kOwners);
  Connect(process);
  Say(process);
}

void ModelOwners::Connect(Process& process) {
  process.end = kOwnerEnds + last_end_++;
  by_end_[process.end] = &process;
}

// Alone or with others of its kind it never is a whole field.
void ModelOwners::SpawnStranger() {
  tally_.Add(Count::kStrangeOwners);
  RegisterOwner as = Registration(random_.Integer(0U, count_ - 1));
  switch (random_.Integer(0, 4)) {
    case 0: as.owners = count_ + 3; break;
    case 1:
      as.owners = count_ + 3;
      as.description.geometry.size.x += 1;
      break;
    case 2: as.boxes.front().end[kAxes[random_.Integer<std::size_t>(0, 2)]] += random_.Integer(-1, 1); break;
    case 3: as.boxes.pop_back(); break;
    default: break;  // another life of an owner, beside it
  }
  Spawn(as, true);
  Process& stranger = processes_.back();
  AtProcess(stranger, service_.now() + random_.Real(0.1, 15), [this, &stranger] { End(stranger, random_.Chance(0.5)); });
}

void ModelOwners::Supervise() {
  if (left_) return;
  for (Process& process : processes_) {
    if (!process.alive || process.machine.refused().ok()) continue;
    tally_.Add(Count::kOwnersRefused);
    CheckError(process.machine.refused());
    End(process, false);
  }
  for (std::uint32_t number = 0; number < count_; ++number) {
    if (LivingOwner(number) == nullptr && (healed_ || random_.Chance(0.3))) Spawn(Registration(number), false);
  }
  service_.queue().After(seconds(1), [this] { Supervise(); });
}

ModelOwners::Process* ModelOwners::LivingOwner(std::uint32_t number) {
  const auto found = std::ranges::find_if(processes_, [&](const Process& process) {
    return process.alive && !process.stranger && process.machine.registration().owner == number;
  });
  return found == processes_.end() ? nullptr : &*found;
}

ModelOwners::Process* ModelOwners::SomeOwner() { return LivingOwner(random_.Integer(0U, count_ - 1)); }

void ModelOwners::End(Process& process, bool silently) {
  process.alive = false;
  process.told_dead = !silently;
}

// Whoever comes begins where the others are, or where the last ones were.
std::uint64_t ModelOwners::Slowest() const {
  std::uint64_t slowest = std::numeric_limits<std::uint64_t>::max(), most = 0;
  for (const Process& process : processes_) {
    if (process.stranger) continue;
    most = std::max(most, process.time);
    if (process.alive) slowest = std::min(slowest, process.time);
  }
  return std::min(slowest, most);
}

void ModelOwners::AtProcess(Process& process, double when, std::function<void()> what) {
  service_.queue().At(when, [this, &process, what = std::move(what)] {
    if (!process.alive) return;
    if (service_.now() < process.held) return AtProcess(process, process.held, what);
    what();
  });
}

void ModelOwners::Send(Process& process, const OwnerToCoordinator& message, const Bytes& payload) {
  const Arrivals arrivals = network_.Send({process.end, kCoordinatorEnd}, service_.now());
  for (int i = 0; i < arrivals.count; ++i) {
    AtCoordinator(arrivals.times.at(std::size_t(i)), [this, end = process.end, message, payload] {
      Follow(owners_->Hear(service_.TokenOf(Node(end)), message, payload, service_.coordinator_time()));
      TakeReads();
      PlanTend(service_.now() + random_.Real(0, 1e-3));
    });
  }
}

void ModelOwners::Say(Process& process) {
  for (const OwnerToCoordinator& message : process.machine.Say(service_.time())) Send(process, message, {});
  const double wake = service_.now() + std::max(0.0, std::chrono::duration<double>(process.machine.NextWake() - service_.time()).count());
  if (wake != process.alarm) {
    process.alarm = wake;
    AtProcess(process, wake, [this, &process, wake] {
      if (process.alarm == wake) Say(process);
    });
  }
  TryBegin(process);
}

void ModelOwners::Hear(Process& process, const CoordinatorToOwner& message) {
  const Epoch before = process.machine.epoch();
  process.machine.Hear(message, service_.time());
  if (before == 0 && process.machine.epoch() != 0) process.known_since = service_.now();
  const auto* const request = std::get_if<ChunkRequest>(&message);
  if (request != nullptr && request->epoch == process.machine.epoch()) Answer(process, *request);
  Say(process);
}

void ModelOwners::Answer(Process& process, const ChunkRequest& request) {
  const Box& box = request.box;
  const std::vector<Box>& own = process.machine.registration().boxes;
  EXPECT_TRUE(std::ranges::any_of(own, [&](const Box& each) { return each.Contains(box); })) << "it does not own these voxels";
  const std::size_t bytes = std::size_t(box.voxel_count()) * sizeof(float);
  EXPECT_LE(bytes, kMostAskedBytes);
  tally_.Add(Count::kOwnersAsked);
  if (random_.Chance(faults_.lost_read)) return tally_.Add(Count::kLostReads);
  double when = service_.now() + random_.Real(50e-6, 5e-3);
  if (random_.Chance(faults_.slow_read)) {
    tally_.Add(Count::kSlowReads);
    when += random_.Real(0.1, 12);
  }
  const auto later = [&](const OwnerToCoordinator& answer, const Bytes& payload) {
    AtProcess(process, when, [this, &process, answer, payload] { Send(process, answer, payload); });
  };
  if (std::ranges::find(process.times, request.dataset) == process.times.end()) {
    tally_.Add(Count::kTimesNotHeld);
    const Status why = Status::Unavailable(fmt::format("time {} is not held any more", request.dataset));
    return later(ChunkRefused{request.epoch, request.dataset, box, request.chunk, why}, {});
  }
  Chunk chunk{.epoch = request.epoch, .dataset = request.dataset, .box = box, .chunk = request.chunk};
  std::vector<std::byte> samples(bytes);
  const float value = ValueOf(request.dataset, process.machine.registration().incarnation);
  for (std::size_t i = 0; i < bytes; i += sizeof(float)) std::memcpy(&samples[i], &value, sizeof(float));
  const bool lies = random_.Chance(faults_.fail_read);
  const int lie = lies ? random_.Integer(0, 5) : -1;
  if (lies) tally_.Add(Count::kLiesOfOwners);
  if (lie == 0) samples.resize(random_.Integer<std::size_t>(1, 9));
  const Bytes payload = PackChunk(Bytes(std::move(samples)), Codec::kRaw, chunk);
  if (lie == 1) chunk.epoch += 1;
  if (lie == 2) chunk.dataset += 1000;  // not one that is asked for: nobody could tell
  if (lie == 3) chunk.box.end.z += 1;
  if (lie == 4) chunk.digest += 1;
  if (lie == 5) later(chunk, payload);  // twice
  later(chunk, payload);
}

void ModelOwners::TryBegin(Process& process) {
  if (!process.alive || process.begun || !process.machine.refused().ok() || service_.now() < process.stalled) return;
  if (!process.stranger && process.time >= Slowest() + drift_) return;
  process.begun = process.machine.FreeSlot();
  if (!process.begun) return tally_.Add(Count::kWaitsForSlots);
  const std::uint64_t overwritten = process.machine.Begin(*process.begun);
  EXPECT_EQ(overwritten, std::exchange(process.times.at(*process.begun), 0));
  CheckOverwritten(process, overwritten);
  // Whoever is behind makes haste.
  const bool behind = std::ranges::any_of(
      processes_, [&](const Process& other) { return other.alive && !other.stranger && other.time > process.time + 2; });
  const double takes = process.step * random_.Real(0.5, 1.5) * (behind ? 0.2 : 1);
  AtProcess(process, service_.now() + takes, [this, &process] { Commit(process); });
}

void ModelOwners::Commit(Process& process) {
  const std::uint32_t slot = *std::exchange(process.begun, std::nullopt);
  ++process.time;
  process.times.at(slot) = process.time;
  process.machine.Commit(slot, process.time, double(process.time) * 0.5);
  Say(process);
  for (Process& other : processes_) TryBegin(other);
}

// As long as they know each other.
void ModelOwners::CheckOverwritten(const Process& process, std::uint64_t time) const {
  if (time == 0 || !orderly_ || process.machine.epoch() != epoch_) return;
  for (const Use& use : uses_) {
    const bool of_it = std::ranges::find(use.incarnations, process.machine.registration().incarnation) != use.incarnations.end();
    EXPECT_TRUE(use.time != time || !of_it || use.since <= process.known_since || use.source.expired())
        << "time " << time << " is overwritten while it is read";
  }
}

void ModelOwners::Steer() {
  if (!service_.coordinator_runs() || service_.now() < service_.coordinator_held()) return;
  const auto now = [this] {
    std::vector<DatasetStatus> datasets = {{.name = kField}};
    owners_->Describe(datasets);
    return datasets.front().simulation;
  };
  SteerDataset order{.dataset = random_.Chance(0.9) ? kField : "nonesuch"};
  for (const char* const name : {"feed", "kill", "other"}) {
    if (random_.Chance(name == std::string("other") ? 0.1 : 0.7)) order.values.push_back({name, random_.Real(-0.5, 1.2)});
  }
  const std::optional<SimulationStatus> before = now();
  const Result<SimulationStatus> steered = owners_->Steer(order);
  const std::optional<SimulationStatus> after = now();
  if (!steered.ok()) {
    EXPECT_EQ(before, after);
    EXPECT_THAT(steered.status().message(), HasSubstr(order.dataset));
    return;
  }
  tally_.Add(Count::kSteered);
  EXPECT_EQ(*steered, after);
  for (const SteeredValue& each : order.values) {
    const auto found = std::ranges::find(steered->steered, each.name, &SteeredParameter::name);
    ASSERT_NE(found, steered->steered.end());
    EXPECT_EQ(found->value, each.value);
    EXPECT_TRUE(found->least <= found->value && found->value <= found->most);
  }
  PlanTend(service_.now());
}

// ---------------------------------------------------------------- the coordinator

void ModelOwners::StartCoordinator(Epoch epoch, std::function<Status(const std::string&)> name_is_free) {
  ++generation_;
  epoch_ = epoch;
  owners_ = std::make_unique<Owners>(epoch, std::move(name_is_free), [this] { woken_ = true; });
  tend_at_ = -1;
  PlanTend(service_.now());
}

void ModelOwners::StopCoordinator() {
  owners_.reset();
  openings_.clear();
  sources_.clear();
  reads_.clear();
  uses_.clear();
  ++generation_;
}

void ModelOwners::AtCoordinator(double when, std::function<void()> what) {
  service_.queue().At(when, [this, generation = generation_, what = std::move(what)] {
    if (generation != generation_ || !service_.coordinator_runs()) return;
    if (service_.now() < service_.coordinator_held()) return AtCoordinator(service_.coordinator_held(), what);
    what();
  });
}

void ModelOwners::Follow(Owners::News news) {
  for (const auto& [to, message] : news.messages) {
    const auto end = int(service_.NodeOf(to).value());
    Process& process = *by_end_.at(end);
    if (!process.alive || process.end != end) {
      if (process.told_dead || process.alive) Follow(owners_->Gone(to, service_.coordinator_time()));
      continue;
    }
    if (const auto* const steered = std::get_if<OwnerSteered>(&message)) {
      const std::vector<SteeredParameter>& declared = process.machine.registration().steered;
      ASSERT_EQ(steered->values.size(), declared.size());
      for (std::size_t i = 0; i < declared.size(); ++i) {
        EXPECT_TRUE(declared[i].least <= steered->values[i] && steered->values[i] <= declared[i].most);
      }
    }
    const Arrivals arrivals = network_.Send({kCoordinatorEnd, end}, service_.now());
    for (int i = 0; i < arrivals.count; ++i) {
      AtProcess(process, arrivals.times.at(std::size_t(i)), [this, &process, end, message = message] {
        if (process.end == end) Hear(process, message);
      });
    }
  }
  for (OwnedData& data : news.datasets) tell_(std::move(data));
}

void ModelOwners::PlanTend(double when) {
  if (tend_at_ >= 0 && tend_at_ <= when) return;
  tend_at_ = when;
  AtCoordinator(when, [this, when] {
    if (tend_at_ == when) Tend();
  });
}

void ModelOwners::Tend() {
  tend_at_ = -1;
  Follow(owners_->Tend(service_.coordinator_time()));
  TakeReads();
  TryOpen();
  EXPECT_LE(owners_->sizes().out, kMostAskedOfOwner);
  PlanTend(woken_.exchange(false) ? service_.now() : service_.now() + 1);
}

// What has come about by the thread that decodes, and by what follows from it.
void ModelOwners::TakeReads() {
  for (bool more = !reads_.empty(); more;) {
    std::promise<void> decoded;
    context_->PostDecode([&] { decoded.set_value(); });
    decoded.get_future().wait();
    std::vector<Done> done;
    {
      const std::lock_guard lock(inbox_->mutex);
      done = std::exchange(inbox_->done, {});
    }
    more = !done.empty() && !reads_.empty();
    for (Done& each : done) {
      if (const auto read = reads_.extract(each.read)) read.mapped()(each.samples);
    }
  }
  if (woken_.exchange(false)) PlanTend(service_.now());
}

std::function<void(Result<Bytes>)> ModelOwners::BeginRead(Ended ended) {
  reads_.emplace(++last_read_, std::move(ended));
  return [inbox = inbox_, read = last_read_](Result<Bytes> samples) {
    const std::lock_guard lock(inbox->mutex);
    inbox->done.push_back({read, std::move(samples)});
  };
}

void ModelOwners::Load(const LoadDataset& action) {
  AtCoordinator(service_.now() + random_.Real(1e-4, 1e-2), [this, action] {
    openings_.push_back({action, service_.coordinator_time()});
    TryOpen();
  });
}

void ModelOwners::Unload(DatasetId dataset) {
  sources_.erase(dataset);
  TakeReads();
}

void ModelOwners::TryOpen() {
  for (const Opening& opening : std::exchange(openings_, {})) {
    if (!TryOpen(opening)) openings_.push_back(opening);
  }
  TakeReads();
}

bool ModelOwners::TryOpen(const Opening& opening) {
  const LoadDataset& action = opening.action;
  auto shown = owners_->Open(DatasetOfPart(action.name), action.source.missing, opening.since, service_.coordinator_time());
  if (!shown) return false;
  if (!shown->ok()) {
    CheckError(shown->status());
    tally_.Add(Count::kOpeningsFailed);
    tell_(DatasetFailed{action.name, action.load, shown->status()});
    return true;
  }
  const std::shared_ptr<Source> opened = Opened(std::move(**shown));
  // The survey reads all voxels.
  const Box bounds = volume_.description.geometry.bounds();
  const auto samples = std::make_shared<std::vector<std::byte>>(opened->voxels.size() * sizeof(float));
  const auto done = BeginRead([this, action, opened](const Result<Bytes>& read) { Loaded(action, opened, read); });
  opened->source->Read(0, bounds, BoxRoom::Dense(bounds, samples->data()), {},
                       [done, samples](const Status& status) { done(status.ok() ? Result(Bytes(std::move(*samples))) : status); });
  return true;
}

std::shared_ptr<ModelOwners::Source> ModelOwners::Opened(OwnedVolume volume) {
  const Box bounds = volume_.description.geometry.bounds();
  EXPECT_EQ(volume.description, volume_.description);
  auto opened = std::make_shared<Source>(Source{.has_holes = !volume.of_nobody.empty()});
  opened->voxels.resize(std::size_t(bounds.voxel_count()));
  Use use{.source = volume.use, .time = volume.field.time, .since = service_.now()};
  for (std::size_t owner = 0; owner < volume.boxes.size(); ++owner) {
    const std::uint64_t incarnation = volume.field.owners[owner].incarnation;
    use.incarnations.push_back(incarnation);
    for (const Box& box : volume.boxes[owner]) {
      for (std::int32_t z = box.begin.z; z < box.end.z; ++z) {
        for (std::int32_t y = box.begin.y; y < box.end.y; ++y) {
          const auto row = opened->voxels.begin() + (std::int64_t{z} * bounds.end.y + y) * bounds.end.x;
          std::fill(row + box.begin.x, row + box.end.x, ValueOf(volume.field.time, incarnation));
        }
      }
    }
  }
  // The last time before an owner left is kept since then; that it was held is known of when it was opened first.
  const auto [first, is_new] = first_opened_.emplace(volume.field.Text(), use.since);
  if (volume.missing.ends_with("the last time before")) use.since = is_new ? 0 : first->second;
  if (is_new) tally_.Add(Count::kTimesOpened);
  std::erase_if(uses_, [](const Use& each) { return each.source.expired(); });
  uses_.push_back(std::move(use));
  opened->source = MakeOwnedSource(std::move(volume), context_);
  return opened;
}

// As BackgroundActions::LoadLevel has it.
void ModelOwners::Loaded(const LoadDataset& action, const std::shared_ptr<Source>& opened, const Result<Bytes>& samples) {
  if (!samples.ok()) {
    CheckError(samples.status());
    return tell_(DatasetFailed{action.name, action.load, samples.status()});
  }
  CheckSamples(*opened, volume_.description.geometry.bounds(), 0, *samples);
  const SourceInfo& info = opened->source->info();
  auto summary = std::make_shared<VolumeSummary>(volume_);
  summary->stored = StoredAt{info.owned, 0, info.version, {{0, 0, 0}, info.levels.front().block}};
  summary->owned = info.levels.front().owned;
  summary->owner_hosts.assign(count_, 0);
  for (const std::string& note : info.notes) summary->missing = note;
  const DatasetId id = IdOf(DatasetOfPart(action.name), volume_.description, *summary->stored);
  sources_.insert_or_assign(id, opened);
  tell_(DatasetLoaded{action.name, action.load, id, std::move(summary), 0, info.growth, {}, opened->source});
}

void ModelOwners::Read(const ChunkRequest& request, std::function<void(const VoxelsToWorker&)> answer) {
  const std::shared_ptr<Source> source = sources_.at(request.dataset);
  const ChunkPart part = PartOfChunk(request.box, kVoxelType, request.chunk);
  const auto done = BeginRead([source, request, begin = part.begin, answer = std::move(answer)](const Result<Bytes>& samples) {
    if (!samples.ok()) {
      CheckError(samples.status());
      return answer(ChunkRefused{request.epoch, request.dataset, request.box, request.chunk, samples.status()});
    }
    CheckSamples(*source, request.box, begin, *samples);
    Chunk chunk{.epoch = request.epoch, .dataset = request.dataset, .box = request.box, .chunk = request.chunk};
    chunk.raw_bytes = chunk.encoded_bytes = std::uint32_t(samples->size());
    answer(chunk);
  });
  ReadPart(source->source, 0, request.box, part.begin, part.bytes, done);
  TakeReads();
}

void ModelOwners::CheckSamples(const Source& source, const Box& box, std::uint64_t begin, const Bytes& samples) {
  const Index3 size = box.size(), sides = source.source->info().finest().geometry.size;
  const auto first = std::int64_t(begin / sizeof(float)), end = first + std::int64_t(samples.size() / sizeof(float));
  for (std::int64_t at = first, row = 0; at < end; at += row) {
    const std::int64_t x = at % size.x, y = at / size.x % size.y, z = at / size.x / size.y;
    row = std::min(size.x - x, end - at);
    const std::int64_t voxel = ((box.begin.z + z) * sides.y + box.begin.y + y) * sides.x + box.begin.x + x;
    const bool same = std::memcmp(&source.voxels[std::size_t(voxel)], samples.span().data() + (at - first) * std::int64_t(sizeof(float)),
                                  std::size_t(row) * sizeof(float)) == 0;
    ASSERT_TRUE(same) << "voxels of another time, or of another life of their owner";
  }
}

// ---------------------------------------------------------------- what must hold

void ModelOwners::CheckPicture(DatasetId dataset, Missing wanted, const std::string& missing) const {
  const auto found = sources_.find(dataset);
  ASSERT_NE(found, sources_.end()) << "a picture of voxels that are not there any more";
  tally_.Add(Count::kPicturesOfOwners);
  if (!missing.empty()) {
    tally_.Add(Count::kPicturesThatLack);
    CheckError(Status::Unavailable(missing));
  }
  if (!found->second->has_holes) return;
  EXPECT_EQ(wanted, Missing::kSkip) << "voxels are missing";
  EXPECT_FALSE(missing.empty()) << "voxels are missing, and it does not say so";
}

void ModelOwners::CheckRecovered() {
  std::vector<DatasetStatus> datasets = {{.name = kField}};
  owners_->Describe(datasets);
  ASSERT_TRUE(datasets.front().simulation);
  EXPECT_EQ(owners_->sizes().owners, count_);
  EXPECT_EQ(owners_->sizes().out + owners_->sizes().waiting, 0U);
  for (std::uint32_t number = 0; number < count_; ++number) {
    const Process* const process = LivingOwner(number);
    ASSERT_NE(process, nullptr);
    EXPECT_EQ(process->machine.epoch(), epoch_);
    if (number == 0 && orderly_) {
      EXPECT_EQ(process->machine.registration().steered, datasets.front().simulation->steered);
    }
  }
}

}  // namespace slabstream
