#include "tests/simulator/hostile_words.h"

#include <gtest/gtest.h>

#include <array>
#include <limits>
#include <string>

#include "tests/simulator/random_world.h"

namespace slabstream {
namespace {

constexpr std::size_t kOverheard = 32;
constexpr WorkerId kNobody = 1000000;  // no worker of any world has this id

// What `make` makes, as the other end decodes it.
auto Decodable(auto&& make) {
  using Messages = decltype(make());
  for (int i = 0; i < 100; ++i) {
    const Messages made = make();
    Result<Messages> decoded = Decode<Messages>(Encode(made), ExpectedPayloadBytes(made));
    if (decoded.ok()) return *std::move(decoded);
  }
  ADD_FAILURE() << "a hostile peer has nothing to say that can be decoded";
  return Messages{};
}

}  // namespace

template <class Messages>
void HostileWords::Memory<Messages>::Keep(Words<Messages> words) {
  if (words_.size() < kOverheard) return words_.push_back(std::move(words));
  words_[next_place_] = std::move(words);
  next_place_ = (next_place_ + 1) % kOverheard;
}

template <class Messages>
auto HostileWords::Memory<Messages>::Again(Random& random) const -> std::optional<Words<Messages>> {
  if (words_.empty() || random.Chance(0.6)) return std::nullopt;
  return words_[random.Integer<std::size_t>(0, words_.size() - 1)];
}

void HostileWords::Overhear(const WorkerToCoordinator& message) {
  if (!std::holds_alternative<Register>(message) && !std::holds_alternative<Heartbeat>(message)) of_workers_.Keep({message, {}});
}

void HostileWords::Overhear(const PartialImage& image, const Bytes& payload) { images_.Keep({image, payload}); }

// Mostly small ones, since ids are.
std::uint64_t HostileWords::Number() {
  if (random_.Chance(0.6)) return random_.Integer<std::uint64_t>(0, 10);
  constexpr std::uint64_t kMost32 = std::numeric_limits<std::uint32_t>::max(), kHalf = std::uint64_t{1} << 63U;
  constexpr std::array<std::uint64_t, 7> kEnds{kMost32 / 2 + 1, kMost32, kMost32 + 1, kHalf - 1, kHalf, kHalf + 1, ~std::uint64_t{0}};
  return random_.Chance(0.7) ? kEnds[random_.Integer<std::size_t>(0, kEnds.size() - 1)] : random_.Integer<std::uint64_t>(0, kEnds.back());
}

Status HostileWords::Reason() {
  return random_.Chance(0.5) ? Status::ResourceExhausted(std::string(random_.Integer<std::size_t>(1, 4096), '?'))
                             : Status::Unavailable("no");
}

ClientToCoordinator HostileWords::OfClient(const Policy& policy) {
  return Decodable([&] { return MakeOfClient(policy); });
}

ClientToCoordinator HostileWords::MakeOfClient(const Policy& policy) {
  switch (random_.Integer(0, 14)) {
    case 0:
    case 1: {
      SubmitFrame submit = RandomRequest(random_, policy, Number(), random_.Chance(0.5) ? Number32() : random_.Integer(1U, 86400000U));
      if (random_.Chance(0.2)) submit.frame.dataset = "../volume";
      if (random_.Chance(0.2)) submit.frame.policy.teams = int(Number32());
      if (random_.Chance(0.2)) submit.frame.policy.groups = int(Number32());
      if (random_.Chance(0.2)) submit.frame.policy.combine = "tree:" + std::to_string(Number());
      return submit;
    }
    case 2: return CancelFrame{Number()};
    case 3:
    case 4: {
      ClientPing ping{.nonce = Number(), .received_bytes = Number()};
      const int open = random_.Chance(0.2) ? 256 : random_.Integer(0, 4);
      for (int i = 0; i < open; ++i) ping.open.push_back(Number());
      return ping;
    }
    case 5: return StatusQuery{Number()};
    case 6: return DataOrder{.nonce = Number()};  // its connection lets only lists through
    case 7: return KeysOrder{.nonce = Number(), .key = std::string(40, 'k')};
    case 8:
      return PickQuery{.nonce = Number(), .frame = RandomRequest(random_, policy, Number(), 1).frame, .x = double(random_.Integer(0, 8))};
    case 9: return VolumePart{.nonce = Number(), .begin = Number(), .bytes = random_.Integer(1U, kMaxVolumePartBytes)};
    case 10: return DropVolume{Number()};
    case 11: {
      AddVolume add{.nonce = Number(), .name = random_.Chance(0.5) ? "sent" : "volume"};
      add.description.geometry.size = Uniform(random_.Integer(1, kMaxVolumeSide));
      return add;
    }
    case 12: return ViewQuery{.nonce = Number(), .frame = RandomRequest(random_, policy, Number(), 1).frame};
    default: return SampleQuery{.nonce = Number(), .dataset = random_.Chance(0.5) ? "volume" : "nonesuch", .points = {{1, 2, 3}}};
  }
}

HostileWords::Words<WorkerToCoordinator> HostileWords::OfWorker(const Speaker& self, std::uint32_t nodes) {
  if (auto again = of_workers_.Again(random_)) return *std::move(again);
  return {Decodable([&] { return MakeOfWorker(self, nodes); }), {}};
}

WorkerToCoordinator HostileWords::MakeOfWorker(const Speaker& self, std::uint32_t nodes) {
  const Epoch epoch = EpochLike(self.epoch);
  const auto worker = WorkerId(Number32());
  switch (random_.Integer(0, 6)) {
    case 0: return Heartbeat{epoch, random_.Chance(0.5) ? self.incarnation : Number(), worker, Number(), Number(), Number32()};
    case 1:
    case 5: return GroupDone{.epoch = epoch, .worker = worker, .key = Key(), .reports = {}, .hidden = {}};
    case 2: {
      FrameImage image{.epoch = epoch, .worker = worker == self.worker ? kNobody : worker, .frame = Number(), .attempt = Number32()};
      image.groups_done = Number32();
      image.group_count = random_.Chance(0.5) ? image.groups_done : Number32();
      image.share_count = random_.Integer(1U, 3U);
      image.share = random_.Integer(0U, image.share_count - 1);
      return image;
    }
    case 3: return WorkerTrouble{epoch, worker, Key(), WorkerId(Number32()), Reason(), random_.Chance(0.5)};
    case 4: return Leave{epoch, worker};
    default: break;
  }
  if (self.incarnation == 0) return Leave{epoch, worker};
  // A new life of its own, or of a worker elsewhere.
  return Register{.incarnation = random_.Integer<Incarnation>(1, ~Incarnation{0}),
                  .pid = Number32(),
                  .host = "elsewhere",
                  .images_endpoint = std::to_string(random_.Chance(0.7) ? self.node : random_.Integer(0U, nodes - 1)),
                  .memory_bytes = Number(),
                  .memory_scope = Number()};
}

HostileWords::Words<WorkerToWorker> HostileWords::ToWorker(const Speaker& self) {
  if (auto again = images_.Again(random_)) return *std::move(again);
  return {Decodable([&] { return MakeToWorker(self); }), {}};
}

WorkerToWorker HostileWords::MakeToWorker(const Speaker& self) {
  const Epoch epoch = EpochLike(self.epoch);
  const WorkerId worker = self.worker == 0 || random_.Chance(0.5) ? kNobody : self.worker;
  const std::uint64_t pixel = random_.Integer<std::uint64_t>(0, 5);
  switch (random_.Integer(0, 4)) {
    case 0: return ImageRefused{epoch, worker, Key(), Number32(), {pixel, pixel + 1}};
    case 1: return ImageReceived{epoch, worker, Number()};
    case 2: return ShapeTiles{.epoch = epoch, .from_worker = worker, .key = Key(), .tiles = {Number32()}, .bytes = {0}};
    default:
      return PartialImage{.epoch = epoch,
                          .from_worker = kNobody,
                          .key = Key(),
                          .step = Number32(),
                          .interval = {Number32(), Number32()},
                          .pixels = {pixel, pixel + 1 + Number()}};
  }
}

}  // namespace slabstream
