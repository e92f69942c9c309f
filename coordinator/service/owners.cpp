#include "coordinator/service/owners.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <condition_variable>
#include <deque>
#include <map>
#include <mutex>
#include <optional>
#include <set>
#include <string_view>
#include <utility>

#include "common/base/overloaded.h"
#include "common/base/printable.h"
#include "common/files/file_stamp.h"
#include "common/frame/dataset_name.h"
#include "common/volume/box_assembly.h"
#include "common/wire/payload.h"
#include "data/open/open_source.h"
#include "data/owned/owned_source.h"
#include "data/owned/voxel_lattice.h"
#include "data/sources/copy_samples.h"
#include "data/volume_io/sample_type.h"

namespace slabstream {
namespace {

using AskDone = std::function<void(Result<Bytes>)>;

struct Asked {
  std::uint64_t time = 0;
  AskedVoxels voxels;
  AskDone done;
  Time since = {};     // it is out
  bool again = false;  // it was asked for twice
};

struct Owner {
  PeerToken peer = 0;
  RegisterOwner registered;
  std::uint64_t latest = 0;          // time; 0: none yet
  std::uint64_t hold = 0, gone = 0;  // as of its last OwnerPing
  Time heard, answered;              // answered: when `out` was empty or last became shorter
  std::vector<Asked> out;            // at most kMostAskedOfOwner
  std::deque<Asked> waiting = {};
};

struct Place {
  std::optional<Owner> owner = {};
  std::string why = "has not come yet";  // there is none
};

bool Has(const Place& place) { return place.owner && place.owner->latest != 0; }  // voxels

struct Field {
  std::vector<Place> places;        // of each field of the dataset all owners, one field after the other
  std::vector<std::string> fields;  // their names; none: it has one without a name

  std::size_t owners() const { return places.size() / std::max<std::size_t>(fields.size(), 1); }  // of a field
  std::uint64_t set = 0;    // another number when an owner comes or goes
  std::uint64_t whole = 0;  // time, of the owners that have any; 0: none has, or not all have come since it had owners
  std::uint64_t shown = 0;  // the last whole time that all were known to hold, and hold; 0: none
  std::uint64_t hold = 0;   // OwnerPong::hold
  bool let_go = false;      // some waited for others for kOwnerWaits: until the next whole time nobody waits
  Time since;               // hold: nobody waits for others for long since then
  bool is_dataset = false;
  // As opened last: what it was read from stays when an owner has gone. Empty: nobody looks, and all are there.
  std::vector<std::shared_ptr<const MappedOwner>> mapped = {};
  std::optional<OwnedVolume> last = {};  // what was shown when the first owner left of those that lack; none: nothing, or none lacks
  std::optional<Time> looked = {};
  OwnerPong told = {};  // last, without nonce
  Time told_at;
  double simulated = 0;                           // of `whole`
  std::vector<SteeredParameter> parameters = {};  // as they are now; they outlive owner 0

  SimulationStatus simulation() const { return {whole, simulated, parameters}; }
};

// Whether each voxel of `bounds` is in exactly one box, and no box has another voxel. The function of space that counts boxes is known by
// its jumps at their corners, so those of the boxes add up to those of `bounds`.
bool Tile(const Box& bounds, const std::vector<Box>& boxes) {
  std::map<std::array<std::int32_t, 3>, std::int64_t> jumps;
  const auto add = [&](const Box& box, int sign) {
    for (int corner = 0; corner < 8; ++corner) {
      const auto at = [&](Axis axis, int bit) { return (corner & bit) != 0 ? box.end[axis] : box.begin[axis]; };
      const bool odd = (((corner & 1) + (corner >> 1 & 1) + (corner >> 2)) & 1) != 0;
      jumps[{at(Axis::kX, 1), at(Axis::kY, 2), at(Axis::kZ, 4)}] += odd ? -sign : sign;
    }
  };
  for (const Box& box : boxes) add(box, 1);
  add(bounds, -1);
  return std::ranges::all_of(jumps, [](const auto& jump) { return jump.second == 0; });
}

bool OfOneField(const RegisterOwner& a, const RegisterOwner& b) {
  return a.owners == b.owners && a.description == b.description && a.samples == b.samples && a.on_demand == b.on_demand &&
         a.fields == b.fields;
}

std::uint32_t PlaceOf(const RegisterOwner& m) { return m.field * m.owners + m.owner; }

// Owner 2 of 4, or owner 2 of 4 of field "u".
std::string OwnerText(std::size_t owner, std::size_t owners, std::span<const std::string> fields, std::size_t field) {
  return fmt::format("owner {} of {}{}", owner, owners, fields.empty() ? "" : fmt::format(" of field \"{}\"", fields[field]));
}

}  // namespace

struct Owners::State : std::enable_shared_from_this<Owners::State> {
  std::mutex mutex;  // guards everything
  Epoch epoch = 0;
  std::function<Status(const std::string&)> name_is_free;  // the service's thread
  std::function<void()> wake;                              // null: the service has ended
  std::map<std::string, Field> fields;                     // with at least one owner
  std::map<PeerToken, std::pair<std::string, std::uint32_t>> peers;
  std::map<std::string, std::map<std::uint64_t, std::size_t>> used;  // sources that live, by field and time
  std::uint64_t sets = 0, holds = 0;
  std::condition_variable changed;
  Time now;
  std::optional<Time> tended = {};  // last
  News news;
  std::vector<std::pair<AskDone, Result<Bytes>>> answers;  // given without the mutex
  std::vector<OwnedVolume> closed;                         // the same

  // Runs `work` with the mutex, then gives answers.
  News Do(Time at, const auto& work) {
    std::unique_lock lock(mutex);
    now = at;
    work();
    const auto given = std::exchange(answers, {});
    const auto unused = std::exchange(closed, {});
    News result = std::exchange(news, {});
    lock.unlock();
    changed.notify_all();
    for (const auto& [done, answer] : given) done(answer);
    return result;
  }

  // ---- owners
  Owner* Find(PeerToken peer) {
    const auto found = peers.find(peer);
    return found == peers.end() ? nullptr : &*fields.at(found->second.first).places[found->second.second].owner;
  }
  static std::string Named(const std::string& name, const Field& field, std::size_t owner) {
    const std::size_t owners = field.owners();
    return fmt::format("\"{}\": {}", name, OwnerText(owner % owners, owners, field.fields, owner / owners));
  }

  Status Check(const RegisterOwner& m, const Field* field) {
    if (Status name = CheckDatasetName(m.dataset); !name.ok()) return name;
    if (field == nullptr || !field->is_dataset) {
      if (Status free = name_is_free(m.dataset); !free.ok()) return free;
    }
    if (field == nullptr && fields.size() >= kMostFields) {
      return Status::ResourceExhausted(fmt::format("\"{}\": {} fields have owners, which is the limit", m.dataset, fields.size()));
    }
    const auto wrong = [&](const std::string& what) { return Wrong(StatusCode::kInvalidArgument, m, what); };
    const std::optional<SampleType> samples = SampleTypeNamed(m.samples);
    if (!samples) return wrong(fmt::format("samples is '{}', must be one of: {}", m.samples, SampleTypeNames()));
    if (const ScalarType kept = KeptTypeOf(*samples).type; m.description.type != kept) {
      return wrong(
          fmt::format("description.type is {}, must be {} for samples of {}", NameOf(m.description.type), NameOf(kept), m.samples));
    }
    const Box bounds = m.description.geometry.bounds();
    for (std::size_t i = 0; i < m.boxes.size(); ++i) {
      if (m.boxes[i].empty() || !bounds.Contains(m.boxes[i])) return wrong(fmt::format("boxes[{}] is empty, or not inside the volume", i));
    }
    if (field == nullptr) return CheckTiled(m, {});
    for (const Place& place : field->places) {
      if (place.owner && !OfOneField(place.owner->registered, m)) {
        return Wrong(
            StatusCode::kUnavailable, m,
            fmt::format("owners, description, samples, on_demand or fields differ from those of owner {}", place.owner->registered.owner));
      }
    }
    const std::optional<Owner>& taken = field->places[PlaceOf(m)].owner;
    if (taken && taken->registered.incarnation != m.incarnation) {
      return Wrong(StatusCode::kUnavailable, m, "another process is this owner");
    }
    return CheckTiled(m, field->places);
  }

  // Unavailable: because of other owners, who may leave.
  static Status Wrong(StatusCode code, const RegisterOwner& m, const std::string& what) {
    return {code, fmt::format("\"{}\": {}: {}", m.dataset, OwnerText(m.owner, m.owners, m.fields, m.field), what)};
  }

  // With the last owner of a field.
  static Status CheckTiled(const RegisterOwner& m, const std::vector<Place>& places) {
    std::vector<Box> boxes = m.boxes;
    std::size_t there = 1;
    for (const Place& place : places) {
      if (!place.owner || place.owner->registered.field != m.field || place.owner->registered.owner == m.owner) continue;
      ++there;
      boxes.insert(boxes.end(), place.owner->registered.boxes.begin(), place.owner->registered.boxes.end());
    }
    if (boxes.size() > kMostFieldBoxes) {
      return Wrong(StatusCode::kUnavailable, m, fmt::format("{} boxes of all owners, limit {}", boxes.size(), kMostFieldBoxes));
    }
    if (there < m.owners || Tile(m.description.geometry.bounds(), boxes)) return Status::Ok();
    return Wrong(StatusCode::kUnavailable, m, "boxes of all owners overlap, or leave voxels out");
  }

  void Hear(PeerToken from, RegisterOwner m) {
    const auto found = fields.find(m.dataset);
    const auto refuse = [&](const Status& why) { news.messages.emplace_back(from, OwnerRefused{m.incarnation, Bounded(why)}); };
    if (Status status = Check(m, found == fields.end() ? nullptr : &found->second); !status.ok()) return refuse(status);
    if (const auto known = peers.find(from); known != peers.end() && known->second != std::pair(m.dataset, PlaceOf(m))) {
      return refuse(Status::InvalidArgument(fmt::format("\"{}\": this connection is that of another owner", m.dataset)));
    }
    Field& field = fields[m.dataset];
    field.fields = m.fields;
    field.places.resize(m.owners * std::max<std::size_t>(m.fields.size(), 1));
    const std::string name = m.dataset;
    const std::uint32_t number = PlaceOf(m);
    std::optional<Owner>& owner = field.places[number].owner;
    if (!owner) owner.emplace().peer = from;
    if (owner->peer != from) peers.erase(std::exchange(owner->peer, from));  // another connection
    owner->registered = std::move(m);
    owner->heard = now;
    owner->hold = 0;
    peers[from] = {name, number};
    NewSet(field);  // it may have overwritten what it held
    FindShown(field);
    const auto in_ms = [](Duration time) { return std::uint32_t(time / std::chrono::milliseconds(1)); };
    news.messages.emplace_back(from, OwnerWelcome{epoch, owner->registered.incarnation, in_ms(kOwnerHeartbeat), in_ms(kOwnerTimeout)});
    news.messages.emplace_back(from, Pong(name, field));
    for (const Asked& asked : owner->out) Request(*owner, asked);  // it has heard nothing of what came before the welcome
    if (number == 0) TakeParameters(field);
  }

  void Hear(PeerToken from, const OwnerTime& m) {
    Owner& owner = *Find(from);
    if (m.time <= owner.latest) return;
    const std::string& name = owner.registered.dataset;
    Field& field = fields.at(name);
    if (std::exchange(owner.latest, m.time) == 0) NewSet(field);
    FindWhole(name, field);
    if (field.whole == m.time) field.simulated = m.simulated;
  }

  void Hear(PeerToken from, const OwnerPing& m) {
    Owner& owner = *Find(from);
    owner.hold = m.hold;
    owner.gone = m.gone;
    if (m.making) {
      owner.answered = now;
      for (Asked& asked : owner.out) asked.since = now;
    }
    const std::string& name = owner.registered.dataset;
    FindShown(fields.at(name));
    OwnerPong pong = Pong(name, fields.at(name));
    pong.nonce = m.nonce;
    news.messages.emplace_back(from, std::move(pong));
  }

  void Hear(PeerToken from, const OwnerLeave&) { Lose(from, "has left"); }

  void Lose(PeerToken peer, const std::string& why) {
    const auto [name, number] = peers.extract(peer).mapped();
    Field& field = fields.at(name);
    FailAsked(*field.places[number].owner, Status::Unavailable(Named(name, field, number) + " " + why));
    if (field.shown != 0 && std::ranges::all_of(field.places, Has)) {
      Forget(field);
      field.last = AtShownTime(name, field);
    }
    field.places[number] = {{}, why};
    NewSet(field);
    FindWhole(name, field);
    if (std::ranges::any_of(field.places, [](const Place& place) { return place.owner.has_value(); })) return;
    if (field.is_dataset) news.datasets.push_back({.name = name, .left = true});
    Forget(field);
    fields.erase(name);
  }

  void Forget(Field& field) {
    if (field.last) closed.push_back(*std::exchange(field.last, std::nullopt));
  }

  // Others have voxels than before.
  void NewSet(Field& field) {
    field.set = ++sets;
    field.hold = field.shown = 0;
    field.let_go = false;
  }

  // ---- times
  void FindWhole(const std::string& name, Field& field) {
    std::uint64_t whole = 0;
    for (const Place& place : field.places) {
      if (Has(place)) whole = whole == 0 ? place.owner->latest : std::min(whole, place.owner->latest);
    }
    if (!field.is_dataset && !std::ranges::all_of(field.places, Has)) whole = 0;
    if (std::exchange(field.whole, whole) != whole) LetGo(field, false);
    FindShown(field);
    if (whole == 0 || std::exchange(field.is_dataset, true)) return;
    OwnedData& news_of = news.datasets.emplace_back(OwnedData{.name = name});
    news_of.came.emplace().path = fmt::format("{} owners", field.places.size());  // for the log
  }

  bool IsLookedAt(const Field& field) const { return field.looked && now < *field.looked + kOwnerLooked; }

  void LetGo(Field& field, bool let_go) {
    if (std::exchange(field.let_go, let_go) != let_go) field.set = ++sets;  // it is opened anew, and says so
  }

  // While somebody looks, owners are told to hold what they have. Once all have said that they do, and what was gone before, a whole time
  // can be shown until there is another one.
  void FindShown(Field& field) {
    // What is kept of an older time would hold up owners with few slots, and the others by them.
    if (std::ranges::all_of(field.places, Has)) Forget(field);
    if (!IsLookedAt(field) || field.whole == 0) {
      field.hold = field.shown = 0;
      return LetGo(field, false);
    }
    if (field.let_go) return;
    const bool all_alike =
        std::ranges::all_of(field.places, [&](const Place& place) { return !Has(place) || place.owner->latest == field.whole; });
    if (all_alike || field.hold == 0) field.since = now;
    if (field.hold == 0) field.hold = ++holds;
    const bool held = std::ranges::all_of(field.places, [&](const Place& place) {
      return !Has(place) || (place.owner->hold == field.hold && place.owner->gone < field.whole);
    });
    if (held && std::exchange(field.shown, field.whole) != field.whole) field.since = now;
    if (now < field.since + kOwnerWaits) return;
    field.hold = 0;
    // The slowest owner may have two slots, with the shown time and the whole one, and no room for the next.
    if (field.shown != field.whole) field.shown = 0;
    LetGo(field, true);
  }

  OwnerPong Pong(const std::string& name, const Field& field) const {
    std::set<std::uint64_t> times;
    if (const auto of = used.find(name); of != used.end()) {
      for (const auto& [time, sources] : of->second) times.insert(time);
    }
    OwnerPong pong{.epoch = epoch, .looked_at = IsLookedAt(field), .hold = field.hold};
    for (const std::uint64_t time : {field.shown, field.whole}) {
      if (pong.looked_at && time != 0) times.insert(time);
    }
    constexpr std::size_t kMost = 64;
    while (times.size() > kMost) times.erase(times.begin());  // no owner has so many slots
    pong.used.assign(times.begin(), times.end());
    return pong;
  }

  // ---- parameters
  // Values that were steered stay if owner 0 comes again with the same names, within its limits.
  void TakeParameters(Field& field) {
    std::vector<SteeredParameter> declared = field.places[0].owner->registered.steered;
    if (std::ranges::equal(declared, field.parameters, {}, &SteeredParameter::name, &SteeredParameter::name)) {
      for (std::size_t i = 0; i < declared.size(); ++i) {
        declared[i].value = std::clamp(field.parameters[i].value, declared[i].least, declared[i].most);
      }
    }
    field.parameters = std::move(declared);
    TellParameters(field);
  }

  void TellParameters(const Field& field) {
    if (field.parameters.empty() || !field.places[0].owner) return;
    OwnerSteered& steered =
        std::get<OwnerSteered>(news.messages.emplace_back(field.places[0].owner->peer, OwnerSteered{.epoch = epoch}).second);
    for (const SteeredParameter& each : field.parameters) steered.values.push_back(each.value);
  }

  Result<SimulationStatus> Steer(const SteerDataset& order) {
    const auto found = fields.find(order.dataset);
    if (found == fields.end()) {
      if (name_is_free(order.dataset).ok()) return Status::NotFound(fmt::format("no dataset \"{}\"", Printable(order.dataset)));
      return Status::InvalidArgument(fmt::format("\"{}\": no simulation holds it", Printable(order.dataset)));
    }
    std::vector<SteeredParameter> steered = found->second.parameters;
    for (const SteeredValue& each : order.values) {
      const auto parameter = std::ranges::find(steered, each.name, &SteeredParameter::name);
      if (parameter == steered.end()) return NoSuchParameter(order.dataset, each.name, steered);
      if (each.value < parameter->least || each.value > parameter->most) {
        return Status::InvalidArgument(
            fmt::format("\"{}\": {} is {}, must be in [{}, {}]", order.dataset, each.name, each.value, parameter->least, parameter->most));
      }
      parameter->value = each.value;
    }
    if (!order.values.empty()) {
      found->second.parameters = std::move(steered);
      TellParameters(found->second);
    }
    return found->second.simulation();
  }

  static Status NoSuchParameter(const std::string& dataset, const std::string& name, const std::vector<SteeredParameter>& known) {
    if (known.empty()) return Status::InvalidArgument(fmt::format("\"{}\" has no parameters", dataset));
    std::vector<std::string_view> names;
    for (const SteeredParameter& each : known) names.push_back(each.name);
    return Status::InvalidArgument(
        fmt::format("\"{}\" has no parameter '{}', must be one of: {}", dataset, Printable(name), fmt::join(names, ", ")));
  }

  // ---- what owners are asked for
  void Request(const Owner& owner, const Asked& asked) {
    news.messages.emplace_back(owner.peer, ChunkRequest{.epoch = epoch,
                                                        .dataset = asked.time,
                                                        .box = asked.voxels.box,
                                                        .level = std::uint32_t(asked.voxels.level),
                                                        .in_place = asked.voxels.in_place});
  }

  void FailAsked(Owner& owner, const Status& why) {
    for (Asked& asked : owner.out) answers.emplace_back(std::move(asked.done), why);
    for (Asked& asked : owner.waiting) answers.emplace_back(std::move(asked.done), why);
    owner.out.clear();
    owner.waiting.clear();
  }

  // What is not answered while others are was lost, perhaps.
  void AskAgain(Owner& owner, Duration asleep) {
    std::erase_if(owner.out, [&](Asked& asked) {
      asked.since = std::min(now, asked.since + asleep);
      if (now < asked.since + kOwnerAnswers) return false;
      asked.since = now;
      if (!std::exchange(asked.again, true)) {
        Request(owner, asked);
        return false;
      }
      const std::string& name = owner.registered.dataset;
      answers.emplace_back(std::move(asked.done), Status::Unavailable(Named(name, fields.at(name), PlaceOf(owner.registered)) +
                                                                      " does not answer a request for voxels"));
      return true;
    });
  }

  // `bytes`: of the samples, which tell what was asked for of the same voxels at several levels, or in place.
  void Answer(Owner& owner, std::uint64_t time, const Box& box, std::optional<std::uint32_t> bytes, Result<Bytes> answer) {
    const auto meant = [&](const Asked& each) { return each.time == time && each.voxels.box == box; };
    const std::size_t of_one = BytesPerSample(*SampleTypeNamed(owner.registered.samples));
    auto asked = std::ranges::find_if(owner.out, [&](const Asked& each) {
      return meant(each) && bytes == (each.voxels.in_place ? 0 : CountIn(PointsAlong(box.size(), each.voxels.level)) * of_one);
    });
    if (asked == owner.out.end()) asked = std::ranges::find_if(owner.out, meant);
    if (asked == owner.out.end()) return;  // nobody waits for it any more
    answers.emplace_back(std::move(asked->done), std::move(answer));
    owner.out.erase(asked);
    owner.answered = now;
  }

  void Refuse(Owner& owner, std::uint64_t time, const Box& box, const Status& why) {
    const std::string& name = owner.registered.dataset;
    Answer(owner, time, box, std::nullopt,
           Status(why.code(), fmt::format("{}: {}", Named(name, fields.at(name), PlaceOf(owner.registered)), why.message())));
  }

  void Hear(PeerToken from, const ChunkRefused& m) { Refuse(*Find(from), m.dataset, m.box, m.status); }

  void Hear(PeerToken from, const Chunk& m, const Bytes& payload) {
    std::vector<std::byte> samples(m.raw_bytes);
    const Status unpacked = UnpackChunk(m, payload.span(), samples);
    if (!unpacked.ok()) return Refuse(*Find(from), m.dataset, m.box, unpacked);
    Answer(*Find(from), m.dataset, m.box, m.raw_bytes, Bytes(std::move(samples)));
  }

  void Tend() {
    // If this process stood still, unread messages are no silence of the others.
    const Duration asleep = std::max(Duration::zero(), now - std::exchange(tended, now).value_or(now) - kOwnerHeartbeat);
    std::vector<PeerToken> silent;
    for (auto& [name, field] : fields) {
      for (Place& place : field.places) {
        if (!place.owner) continue;
        Owner& owner = *place.owner;
        owner.heard = std::min(now, owner.heard + asleep);
        owner.answered = std::min(now, owner.answered + asleep);
        if (now >= owner.heard + kOwnerTimeout) silent.push_back(owner.peer);
        if (owner.out.empty()) owner.answered = now;
        if (now >= owner.answered + kOwnerAnswers) {
          FailAsked(owner, Status::Unavailable(Named(name, field, PlaceOf(owner.registered)) + " answers no request for voxels"));
        }
        AskAgain(owner, asleep);
        for (; !owner.waiting.empty() && owner.out.size() < kMostAskedOfOwner; owner.waiting.pop_front()) {
          Request(owner, owner.waiting.front());
          owner.out.push_back(std::move(owner.waiting.front()));
          owner.out.back().since = now;
        }
      }
      FindShown(field);
      if (!IsLookedAt(field) && std::ranges::all_of(field.places, Has)) field.mapped.clear();
      const OwnerPong pong = Pong(name, field);
      // While somebody looks, it comes every heartbeat: who cannot be sent one has ended.
      if (pong != field.told || (pong.looked_at && now >= field.told_at + kOwnerHeartbeat)) {
        for (const Place& place : field.places) {
          if (place.owner) news.messages.emplace_back(place.owner->peer, pong);
        }
        field.told = pong;
        field.told_at = now;
      }
      // The machine gives another time up as soon as nobody waits for it, but for the one that is kept while an owner is gone.
      const auto oldest =
          std::ranges::find_if(pong.used, [&](std::uint64_t time) { return !field.last || time != field.last->field.time; });
      if (field.is_dataset && oldest != pong.used.end() && *oldest != (field.shown != 0 ? field.shown : field.whole))
        news.datasets.push_back({.name = name});
    }
    for (const PeerToken peer : silent) Lose(peer, "is silent");
  }

  // ---- from any thread
  void Look(Field& field, Time at) {
    const bool begins = !IsLookedAt(field);
    field.looked = std::max(field.looked.value_or(at), at);
    if (begins && wake) wake();
  }

  // Ok: all owners are there, and each has a time.
  static Status WhoLacks(const std::string& name, const Field& field) {
    for (std::size_t i = 0; i < field.places.size(); ++i) {
      const Place& place = field.places[i];
      if (!place.owner) return Status::Unavailable(Named(name, field, i) + " " + place.why);
      if (!Has(place)) return Status::Unavailable(Named(name, field, i) + " has no time yet");
    }
    return Status::Ok();
  }

  static Status NoCommonTime(const std::string& name, const Field& field) {
    const auto latest = [](const Place& place) { return Has(place) ? place.owner->latest : 0; };
    const auto first = std::ranges::max_element(field.places, {}, latest), last = std::ranges::min_element(field.places, {}, latest);
    return Status::Unavailable(fmt::format("{} is at time {}, but owner {} at {}: there was no time that all hold for {} s",
                                           Named(name, field, std::size_t(last - field.places.begin())), latest(*last),
                                           first - field.places.begin(), latest(*first), kOwnerWaits / std::chrono::seconds(1)));
  }

  struct Shown {
    OwnedVolume volume;
    bool lacks = false;  // owners
  };
  std::optional<Result<Shown>> Show(const std::string& name, Missing missing, Time since, Time at);  // with the mutex
  Result<std::shared_ptr<VolumeSource>> Open(const std::string& name, Missing missing);
  OwnedVolume AtShownTime(const std::string& name, const Field& field);
  OwnedVolume AtShownTime(const std::string& name, const Field& field, std::size_t number, std::vector<Box>& missing);
  std::shared_ptr<const void> Use(const std::string& name, std::uint64_t time);  // with the mutex
  void Ask(const std::string& name, std::uint32_t number, Incarnation incarnation, Asked asked);
};

void Owners::State::Ask(const std::string& name, std::uint32_t number, Incarnation incarnation, Asked asked) {
  std::unique_lock lock(mutex);
  const auto field = fields.find(name);
  std::optional<Owner>* const owner = field == fields.end() ? nullptr : &field->second.places.at(number).owner;
  if (wake && owner != nullptr && *owner && (*owner)->registered.incarnation == incarnation) {
    (*owner)->waiting.push_back(std::move(asked));
    return wake();
  }
  lock.unlock();
  asked.done(Status::Unavailable(fmt::format("\"{}\": owner {} has left", name, number)));
}

std::shared_ptr<const void> Owners::State::Use(const std::string& name, std::uint64_t time) {
  ++used[name][time];
  return {this, [state = shared_from_this(), name, time](const void*) {
            const std::lock_guard lock(state->mutex);
            std::map<std::uint64_t, std::size_t>& of = state->used.at(name);
            if (--of.at(time) == 0) of.erase(time);
            if (of.empty()) state->used.erase(name);
            if (state->wake) state->wake();
          }};
}

// Of the owners that have any voxels. What one field lacks shows nothing of the others.
OwnedVolume Owners::State::AtShownTime(const std::string& name, const Field& field) {
  std::vector<Box> missing;
  std::vector<OwnedVolume> volumes;
  for (std::size_t number = 0; number < std::max<std::size_t>(field.fields.size(), 1); ++number) {
    volumes.push_back(AtShownTime(name, field, number, missing));
  }
  for (OwnedVolume& volume : volumes) {
    volume.of_nobody = missing;
    for (std::vector<Box>& boxes : volume.boxes) {
      std::vector<Box> rest;
      for (const Box& box : boxes) std::ranges::copy(Assemble(box, missing).missing, std::back_inserter(rest));
      boxes = std::move(rest);
    }
  }
  OwnedVolume volume = volumes.front();
  for (const std::string& each : field.fields) volume.channels.push_back({.name = each});
  volume.fields = std::make_shared<const std::vector<OwnedVolume>>(std::move(volumes));
  return volume;
}

// `missing`: boxes that do not overlap; what this field lacks is added.
OwnedVolume Owners::State::AtShownTime(const std::string& name, const Field& field, std::size_t number, std::vector<Box>& missing) {
  OwnedVolume volume{.field = {name, field.shown, {}}};
  std::vector<Incarnation> incarnations;
  std::vector<Box> held = missing;
  const std::span places = std::span(field.places).subspan(number * field.owners(), field.owners());
  for (const Place& place : places) {
    const RegisterOwner& owner = Has(place) ? place.owner->registered : RegisterOwner();
    volume.field.owners.push_back({owner.memory_scope, owner.pid, owner.file_descriptor, owner.incarnation});
    incarnations.push_back(owner.incarnation);
    volume.boxes.push_back(owner.boxes);
    held.insert(held.end(), owner.boxes.begin(), owner.boxes.end());
  }
  const RegisterOwner& any = std::ranges::find_if(field.places, Has)->owner->registered;
  volume.description = any.description;
  volume.exact = {*SampleTypeNamed(any.samples), any.description.mapping};
  volume.description.mapping.offset = any.description.mapping.FromStored(KeptTypeOf(volume.exact.type).shift);
  volume.on_demand = any.on_demand;
  for (const Box& box : held) {
    if (any.on_demand && box.begin == Index3{}) volume.field.block = box.size();
  }
  std::ranges::copy(Assemble(any.description.geometry.bounds(), held).missing, std::back_inserter(missing));
  volume.ask = [state = shared_from_this(), name, first = std::uint32_t(places.data() - field.places.data()), time = field.shown,
                incarnations](std::uint32_t owner, const AskedVoxels& voxels, AskDone done) {
    state->Ask(name, first + owner, incarnations[owner], {time, voxels, std::move(done)});
  };
  volume.use = Use(name, field.shown);
  return volume;
}

std::optional<Result<Owners::State::Shown>> Owners::State::Show(const std::string& name, Missing missing, Time since, Time at) {
  const auto found = fields.find(name);
  if (found == fields.end()) return Status::Unavailable(fmt::format("\"{}\": its owners have left", name));
  Field& field = found->second;
  const Status lacks = WhoLacks(name, field);
  if (!lacks.ok() && missing == Missing::kFail) return lacks;
  if (!wake) return Status::Unavailable("the coordinator ends");
  Look(field, at);
  Shown shown{.lacks = !lacks.ok()};
  OwnedVolume& volume = shown.volume;
  const bool is_last = shown.lacks && missing == Missing::kLast;
  if (is_last) {
    if (!field.last) return Status::Unavailable(lacks.message() + ", and nobody looked before");
    volume = *field.last;
    volume.missing = lacks.message() + ": this is the last time before";
  } else if (field.shown == 0) {
    if (at < since + kOwnerWaits) return std::nullopt;
    return NoCommonTime(name, field);
  } else {
    volume = AtShownTime(name, field);
    if (shown.lacks) {
      volume.missing = lacks.message() + ": its voxels show nothing";
    } else if (field.let_go) {
      const auto late = std::ranges::find(field.places, field.whole, [](const Place& place) { return place.owner->latest; });
      volume.missing = fmt::format("{} has given no time after {}, and others have gone on",
                                   Named(name, field, std::size_t(late - field.places.begin())), field.whole);
    }
  }
  volume.growth = std::make_shared<const FileStamp>(
      FileStamp{.ask = [state = shared_from_this(), name, is_last, time = field.shown, set = field.set](Time asked) {
        const std::lock_guard of_state(state->mutex);
        const auto known = state->fields.find(name);
        if (known == state->fields.end()) return true;
        state->Look(known->second, asked);
        return (!is_last && known->second.shown != time) || known->second.set != set;
      }});
  return shown;
}

Result<std::shared_ptr<VolumeSource>> Owners::State::Open(const std::string& name, Missing missing) {
  const Time since = MonotonicNow();
  std::unique_lock lock(mutex);
  std::optional<Result<Shown>> shown;
  while (!(shown = Show(name, missing, since, MonotonicNow()))) changed.wait_until(lock, since + kOwnerWaits);
  lock.unlock();
  if (!shown->ok()) return shown->status();
  std::vector<std::shared_ptr<const MappedOwner>> mapped;
  for (const OwnedVolume& of : *(*shown)->volume.fields) {
    for (const OwnerPlace& place : of.field.owners) {
      if (const auto owner = MappedOwner::Open(place); owner.ok()) mapped.push_back(*owner);
    }
  }
  auto source = MakeOwnedSource(std::move((*shown)->volume), ProcessReadContext());
  lock.lock();
  const auto known = fields.find(name);
  if (!(*shown)->lacks && known != fields.end()) known->second.mapped = std::move(mapped);
  lock.unlock();
  return source;
}

Owners::Owners(Epoch epoch, std::function<Status(const std::string&)> name_is_free, std::function<void()> wake)
    : state_(std::make_shared<State>()) {
  state_->epoch = epoch;
  state_->name_is_free = std::move(name_is_free);
  state_->wake = std::move(wake);
}

Owners::~Owners() {
  (void)state_->Do(MonotonicNow(), [this] {
    state_->wake = nullptr;
    for (auto& [name, field] : state_->fields) {
      state_->Forget(field);
      for (Place& place : field.places) {
        if (place.owner) state_->FailAsked(*place.owner, Status::Unavailable("the coordinator ends"));
      }
    }
  });
}

Owners::News Owners::Hear(PeerToken from, OwnerToCoordinator message, const Bytes& payload, Time now) {
  News news = state_->Do(now, [&] {
    if (auto* const registration = std::get_if<RegisterOwner>(&message)) return state_->Hear(from, std::move(*registration));
    const Epoch epoch = std::visit(
        []<class Message>(const Message& each) -> Epoch {
          if constexpr (std::is_same_v<Message, RegisterOwner>) {
            return 0;
          } else {
            return each.epoch;
          }
        },
        message);
    Owner* const owner = state_->Find(from);
    if (owner == nullptr || epoch != state_->epoch) return void(state_->news.messages.emplace_back(from, Retire{state_->epoch}));
    owner->heard = now;
    std::visit(Overloaded{[&](const Chunk& chunk) { state_->Hear(from, chunk, payload); }, [](const RegisterOwner&) {},
                          [&](const auto& each) { state_->Hear(from, each); }},
               message);
  });
  for (OwnedData& data : news.datasets) {
    if (data.came) data.came->open = [state = state_, name = data.name](Missing missing) { return state->Open(name, missing); };
  }
  return news;
}

Result<SimulationStatus> Owners::Steer(const SteerDataset& order) {
  const std::lock_guard lock(state_->mutex);
  return state_->Steer(order);
}

void Owners::Describe(std::vector<DatasetStatus>& datasets) const {
  const std::lock_guard lock(state_->mutex);
  for (DatasetStatus& each : datasets) {
    if (const auto field = state_->fields.find(each.name); field != state_->fields.end()) each.simulation = field->second.simulation();
  }
}

std::optional<Result<OwnedVolume>> Owners::Open(const std::string& name, Missing missing, Time since, Time now) {
  const std::lock_guard lock(state_->mutex);
  auto shown = state_->Show(name, missing, since, now);
  if (!shown) return std::nullopt;
  return shown->ok() ? Result(std::move((*shown)->volume)) : shown->status();
}

OwnerSizes Owners::sizes() const {
  const std::lock_guard lock(state_->mutex);
  OwnerSizes sizes{.fields = state_->fields.size(), .owners = state_->peers.size()};
  for (const auto& [name, field] : state_->fields) {
    for (const Place& place : field.places) {
      if (!place.owner) continue;
      sizes.out = std::max(sizes.out, place.owner->out.size());
      sizes.waiting += place.owner->waiting.size();
    }
  }
  for (const auto& [name, times] : state_->used) {
    for (const auto& [time, sources] : times) sizes.uses += sources;
  }
  return sizes;
}

Owners::News Owners::Gone(PeerToken peer, Time now) {
  return state_->Do(now, [&] {
    if (state_->Find(peer) != nullptr) state_->Lose(peer, "has ended");
  });
}

Owners::News Owners::Tend(Time now) {
  return state_->Do(now, [this] { state_->Tend(); });
}

}  // namespace slabstream
