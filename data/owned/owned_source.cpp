#include "data/owned/owned_source.h"

#include <fmt/format.h>
#include <xxhash.h>

#include <atomic>
#include <charconv>
#include <map>
#include <mutex>
#include <optional>
#include <string_view>
#include <utility>

#include "common/frame/dataset_name.h"
#include "common/volume/box_assembly.h"
#include "common/volume/missing.h"
#include "common/volume/stored_at.h"
#include "data/owned/voxel_lattice.h"
#include "data/sources/box_reading.h"
#include "data/sources/copy_samples.h"

namespace slabstream {
namespace {

// The text up to the next `end`, which is taken away with it; nullopt: there is none.
std::optional<std::string_view> TakeUpTo(std::string_view& text, char end) {
  const std::size_t at = text.find(end);
  if (at == std::string_view::npos) return std::nullopt;
  const std::string_view taken = text.substr(0, at);
  text.remove_prefix(at + 1);
  return taken;
}

template <class T>
bool TakeNumber(std::string_view& text, char end, T& number) {
  const std::optional<std::string_view> taken = TakeUpTo(text, end);
  return taken && std::from_chars(taken->data(), taken->data() + taken->size(), number, 16).ptr == taken->data() + taken->size() &&
         !taken->empty();
}

// Boxes of owners, all in one list: where the samples of a voxel are.
struct Places {
  struct Of {
    std::uint32_t owner = 0;
    std::size_t box = 0;  // of the owner
  };
  std::vector<Box> boxes;
  std::vector<Of> of;

  std::shared_ptr<const OwnedBoxes> Owned() const {
    auto owned = std::make_shared<OwnedBoxes>();
    for (std::size_t i = 0; i < boxes.size(); ++i) owned->push_back({boxes[i], of[i].owner});
    return owned;
  }
  void Add(const Box& box, std::uint32_t owner, std::size_t number) {
    boxes.push_back(box);
    of.push_back({owner, number});
  }
  Places At(const VoxelLattice& lattice) const {
    Places points;
    for (std::size_t i = 0; i < boxes.size(); ++i) {
      if (const Box box = lattice.PointsIn(boxes[i]); !box.empty()) points.Add(box, of[i].owner, of[i].box);
    }
    return points;
  }
  // Cuts what these boxes have out of `wanted`.
  void Take(std::vector<Box>& wanted, const auto& take) const {
    std::vector<Box> missing;
    for (const Box& box : wanted) {
      const BoxAssembly found = Assemble(box, boxes);
      for (const BoxAssembly::Part& part : found.copied) take(of[part.source], part.box);
      missing.insert(missing.end(), found.missing.begin(), found.missing.end());
    }
    wanted = std::move(missing);
  }
};

// Parts of a box of which each is asked for at once.
void ForEachAsked(const Box& box, std::size_t sample_bytes, const auto& visit) {
  if (std::size_t(box.voxel_count()) * sample_bytes <= kMostAskedBytes) return visit(box);
  const Index3 size = box.size();
  const Axis axis = size.z > 1 ? Axis::kZ : size.y > 1 ? Axis::kY : Axis::kX;
  Box lower = box, upper = box;
  lower.end[axis] = upper.begin[axis] = box.begin[axis] + size[axis] / 2;
  ForEachAsked(lower, sample_bytes, visit);
  ForEachAsked(upper, sample_bytes, visit);
}

class OwnedSource final : public VolumeSource {
 public:
  OwnedSource(OwnedVolume volume, std::vector<std::shared_ptr<const MappedOwner>> mapped, SourceContext context)
      : shared_(std::make_shared<Shared>(std::move(volume), std::move(mapped), std::move(context))) {
    const OwnedVolume& of = shared_->volume;
    info_ = {.levels = {},
             .format = "owners",
             .file_type = std::string(ToString(of.exact.type)),
             .exact = of.exact,
             .channels = of.channels,
             .channel = of.channel,
             .growth = of.growth,
             .on_demand = of.on_demand};
    info_.owned = of.field.Text();
    if (!of.missing.empty()) info_.notes = {of.missing};
    info_.version = XXH3_64bits(info_.owned.data(), info_.owned.size());
    Level voxels;
    for (const Box& box : of.of_nobody) voxels.nobodys.Add(box, kNoOwner, 0);
    for (std::uint32_t owner = 0; owner < of.field.owners.size(); ++owner) {
      if (const auto& memory = shared_->mapped[owner]; memory != nullptr) {
        const std::vector<HeldBox>& boxes = memory->layout().boxes;
        for (std::size_t i = 0; i < boxes.size(); ++i) {
          voxels.here.Add(boxes[i].box, owner, i);
          voxels.ghosts.Add(boxes[i].held, owner, i);
        }
      } else if (of.ask) {
        for (std::size_t i = 0; i < of.boxes[owner].size(); ++i) voxels.elsewhere.Add(of.boxes[owner][i], owner, i);
      }
    }
    Places owned;
    for (std::uint32_t owner = 0; owner < of.boxes.size(); ++owner) {
      for (const Box& box : of.boxes[owner]) owned.Add(box, owner, 0);
    }
    for (const Box& box : of.of_nobody) owned.Add(box, kNoOwner, 0);
    const VolumeGeometry& geometry = of.description.geometry;
    do {
      const VoxelLattice lattice = VoxelLattice::Of(geometry.size, int(levels_.size()));
      levels_.push_back(
          {lattice, voxels.nobodys.At(lattice), voxels.here.At(lattice), voxels.ghosts.At(lattice), voxels.elsewhere.At(lattice)});
      SourceLevel& level = info_.levels.emplace_back(of.description, of.field.block);
      if (!geometry.rectilinear()) level.description.geometry = lattice.In(geometry);
      if (!of.boxes.empty()) level.owned = owned.At(lattice).Owned();
    } while (info_.levels.back().description.voxel_bytes() > kCoarsestBytes && !geometry.rectilinear() && !of.on_demand);
  }

  const SourceInfo& info() const override { return info_; }

  std::shared_ptr<VolumeSource> At(int time, int channel) override {
    const OwnedVolume& of = shared_->volume;
    if (time != info_.time || of.fields == nullptr || std::size_t(channel) >= of.fields->size()) return nullptr;
    OwnedVolume other = (*of.fields)[std::size_t(channel)];
    other.fields = of.fields;
    other.channels = of.channels;
    other.channel = channel;
    other.missing = of.missing;
    other.growth = of.growth;
    return MakeOwnedSource(std::move(other), shared_->context);
  }

  Counts counts() const override { return {.stored_bytes = shared_->asked_bytes, .chunks = 0}; }

  VoxelReach Reaches(int level, const Box& box) const override {
    const Level& of = levels_.at(std::size_t(level));
    std::vector<Box> missing = {box};
    bool made = true;
    for (const Places* places : {&of.here, &of.ghosts}) {
      places->Take(missing, [&](const Places::Of& from, const Box&) { made = made && shared_->IsMade(from); });
    }
    for (const Places* places : {&of.nobodys, &of.elsewhere}) places->Take(missing, [](const Places::Of&, const Box&) {});
    return !missing.empty() ? VoxelReach::kNever : made ? VoxelReach::kNow : VoxelReach::kOnceMade;
  }

  void Make(const Box& box, ReadDone done) override {
    const Level& of = levels_.front();
    const auto reading = std::make_shared<BoxReading>(box, BoxRoom(), std::stop_token(), std::move(done));
    std::vector<Box> missing = {box};
    for (const Places* places : {&of.here, &of.elsewhere}) {
      places->Take(missing, [&](const Places::Of& from, const Box&) {
        if (!shared_->IsMade(from)) shared_->AskToMake(shared_, reading, from);
      });
    }
    reading->EndPart();
  }

  using VolumeSource::Read;
  void Read(int level, const Box& box, const BoxRoom& out, std::stop_token stop, ReadDone done) override {
    const Level& of = levels_.at(std::size_t(level));
    CHECK(!box.empty() && Box({}, of.lattice.size).Contains(box)) << "a box outside the volume";
    const auto reading = std::make_shared<BoxReading>(box, out, std::move(stop), std::move(done));
    std::vector<Box> missing = {box};
    std::vector<std::pair<Places::Of, Box>> copied;
    for (const Places* places : {&of.here, &of.ghosts}) {
      places->Take(missing, [&](const Places::Of& from, const Box& part) { copied.emplace_back(from, part); });
    }
    of.nobodys.Take(missing, [&](const Places::Of&, const Box& part) {
      constexpr std::array<std::byte, 8> kZero = {};
      CopySamples(info_.exact.type, kZero.data(), {0, 0, 0}, part.size(), shared_->RoomOf(*reading, part));
    });
    if (!copied.empty()) {
      reading->BeginPart();
      shared_->context->PostDecode([shared = shared_, reading, lattice = of.lattice, copied = std::move(copied)] {
        for (const auto& [from, part] : copied) {
          if (!reading->goes_on()) break;
          const Status read = shared->mapped[from.owner]->Read(from.box, lattice.VoxelsOf(part), lattice.level, shared->volume.field.time,
                                                               shared->RoomOf(*reading, part));
          if (read.ok()) continue;
          if (shared->volume.on_demand && shared->volume.ask) {
            ForEachAsked(part, BytesPerSample(shared->volume.exact.type),
                         [&](const Box& asked) { shared->Ask(shared, reading, from.owner, lattice, asked); });
          } else {
            reading->Fail(shared->Named(read));
          }
        }
        if (reading->stop().stop_requested()) reading->GiveUp();
        reading->EndPart();
      });
    }
    of.elsewhere.Take(missing, [&](const Places::Of& from, const Box& part) {
      ForEachAsked(part, BytesPerSample(info_.exact.type), [&](const Box& asked) {
        if (reading->stop().stop_requested()) reading->GiveUp();
        if (reading->goes_on()) shared_->Ask(shared_, reading, from.owner, of.lattice, asked);
      });
    });
    if (!missing.empty()) reading->Fail(shared_->Named(Status::Unavailable("its owners are on other hosts")));
    reading->EndPart();
  }

 private:
  // What reads need, which may outlive the source.
  struct Shared {
    Shared(OwnedVolume of_volume, std::vector<std::shared_ptr<const MappedOwner>> of_owners, SourceContext of_process)
        : volume(std::move(of_volume)), mapped(std::move(of_owners)), context(std::move(of_process)) {}

    // Where samples of a part of what is read go.
    BoxRoom RoomOf(const BoxReading& reading, const Box& part) const {
      BoxRoom room = reading.out();
      const Index3 at = part.begin - reading.box().begin;
      room.first += (at.z * room.slice + at.y * room.row + at.x) * std::int64_t(CopiedBytes(volume.exact.type, room.exact));
      return room;
    }
    Status Named(const Status& status) const { return {status.code(), fmt::format("\"{}\": {}", volume.field.dataset, status.message())}; }

    // Others are not known to be.
    bool IsMade(const Places::Of& from) const {
      return mapped[from.owner] != nullptr && mapped[from.owner]->Has(from.box, volume.field.time);
    }

    // What several wait for is asked for once.
    void AskToMake(const std::shared_ptr<Shared>& self, const std::shared_ptr<BoxReading>& reading, const Places::Of& from) {
      reading->BeginPart();
      const std::pair key(from.owner, from.box);
      {
        const std::lock_guard lock(mutex);
        std::vector<std::shared_ptr<BoxReading>>& waiting = made[key];
        waiting.push_back(reading);
        if (waiting.size() > 1) return;
      }
      const auto& memory = mapped[from.owner];
      const Box& box = memory != nullptr ? memory->layout().boxes[from.box].box : volume.boxes[from.owner][from.box];
      volume.ask(from.owner, {.box = box, .in_place = true}, [self, key](const Result<Bytes>& answer) {
        std::unique_lock lock(self->mutex);
        const auto waiting = self->made.extract(key);
        lock.unlock();
        for (const std::shared_ptr<BoxReading>& each : waiting.mapped()) {
          if (!answer.ok()) each->Fail(answer.status());
          each->EndPart();
        }
      });
    }

    void Ask(const std::shared_ptr<Shared>& self, const std::shared_ptr<BoxReading>& reading, std::uint32_t owner,
             const VoxelLattice& lattice, const Box& box) {
      reading->BeginPart();
      volume.ask(owner, {.box = lattice.VoxelsOf(box), .level = lattice.level}, [self, reading, box](Result<Bytes> samples) {
        self->context->PostDecode([self, reading, box, samples = std::move(samples)] {
          const SampleType type = self->volume.exact.type;
          const Index3 size = box.size();
          if (!samples.ok()) {
            reading->Fail(samples.status());
          } else if (samples->size() != std::size_t(box.voxel_count()) * BytesPerSample(type)) {
            reading->Fail(self->Named(Status::DataLoss(fmt::format("an owner sent {} bytes for a box", samples->size()))));
          } else if (reading->goes_on()) {
            self->asked_bytes += samples->size();
            CopySamples(type, samples->span().data(), {1, size.x, std::int64_t{size.x} * size.y}, size, self->RoomOf(*reading, box));
          }
          reading->EndPart();
        });
      });
    }

    const OwnedVolume volume;
    const std::vector<std::shared_ptr<const MappedOwner>> mapped;  // of each owner; null: it is not on this host
    const SourceContext context;
    std::atomic<std::uint64_t> asked_bytes = 0;
    std::mutex mutex;
    std::map<std::pair<std::uint32_t, std::size_t>, std::vector<std::shared_ptr<BoxReading>>> made;  // who waits for it; with the mutex
  };
  const std::shared_ptr<Shared> shared_;
  SourceInfo info_;
  struct Level {
    VoxelLattice lattice = {};
    // What nobody owns, what owners on this host own, what they hold beside, and what other owners own.
    Places nobodys = {}, here = {}, ghosts = {}, elsewhere = {};
  };
  std::vector<Level> levels_;
};

std::vector<std::shared_ptr<const MappedOwner>> MapOwners(const OwnedField& field, const std::optional<OwnerLayout>& as) {
  std::vector<std::shared_ptr<const MappedOwner>> mapped;
  for (const OwnerPlace& place : field.owners) {
    const Result<std::shared_ptr<const MappedOwner>> owner = MappedOwner::Open(place);
    const bool fits = owner.ok() &&
                      (!as || ((*owner)->layout().size == as->size && (*owner)->layout().samples == as->samples &&
                               (*owner)->layout().on_demand == as->on_demand)) &&
                      (*owner)->Reaches(field.time);
    mapped.push_back(fits ? *owner : nullptr);
  }
  return mapped;
}

}  // namespace

std::string OwnedField::Text() const {
  std::string text = fmt::format("{}{}:{:x}:{:x}.{:x}.{:x}:", kOwnersMark, dataset, time, block.x, block.y, block.z);
  std::uint64_t scope = 0;
  for (const OwnerPlace& owner : owners) {
    if (owner.scope != std::exchange(scope, owner.scope)) text += fmt::format("@{:x}.", owner.scope);
    text += fmt::format("{:x}.{:x}.{:x},", owner.pid, owner.file_descriptor, owner.incarnation);
  }
  return text;
}

Result<OwnedField> OwnedField::Parse(const std::string& text) {
  const auto wrong = [] { return Status::InvalidArgument("a source of owners that nobody has written"); };
  std::string_view rest = text;
  if (!rest.starts_with(kOwnersMark)) return wrong();
  rest.remove_prefix(kOwnersMark.size());
  OwnedField field;
  const std::optional<std::string_view> name = TakeUpTo(rest, ':');
  Index3& block = field.block;
  if (!name || !CheckDatasetName(std::string(*name)).ok() || !TakeNumber(rest, ':', field.time) || !TakeNumber(rest, '.', block.x) ||
      !TakeNumber(rest, '.', block.y) || !TakeNumber(rest, ':', block.z) || Min(block, Uniform(1)) != Uniform(1) ||
      Max(block, Uniform(kMaxVolumeSide)) != Uniform(kMaxVolumeSide)) {
    return wrong();
  }
  field.dataset = *name;
  for (OwnerPlace owner; !rest.empty(); field.owners.push_back(owner)) {
    if (rest.front() == '@') {
      rest.remove_prefix(1);
      if (!TakeNumber(rest, '.', owner.scope)) return wrong();
    }
    if (!TakeNumber(rest, '.', owner.pid) || !TakeNumber(rest, '.', owner.file_descriptor) || !TakeNumber(rest, ',', owner.incarnation)) {
      return wrong();
    }
  }
  return field;
}

std::shared_ptr<VolumeSource> MakeOwnedSource(OwnedVolume volume, const SourceContext& context) {
  auto mapped = MapOwners(
      volume.field, OwnerLayout{.samples = volume.exact.type, .size = volume.description.geometry.size, .on_demand = volume.on_demand});
  return std::make_shared<OwnedSource>(std::move(volume), std::move(mapped), context);
}

Result<std::shared_ptr<VolumeSource>> OpenOwned(const std::string& text, const SourceContext& context) {
  Result<OwnedField> field = OwnedField::Parse(text);
  if (!field.ok()) return field.status();
  std::vector<std::shared_ptr<const MappedOwner>> mapped = MapOwners(*field, {});
  OwnedVolume volume{.field = *std::move(field)};
  for (auto& owner : mapped) {
    if (owner == nullptr) continue;
    const OwnerLayout& layout = owner->layout();
    VolumeDescription& description = volume.description;
    if (description.geometry.size == Index3{}) {
      description.geometry.size = layout.size;
      description.type = KeptTypeOf(layout.samples).type;
      volume.exact.type = layout.samples;
      volume.on_demand = layout.on_demand;
    }
    if (layout.size != description.geometry.size || layout.samples != volume.exact.type || layout.on_demand != volume.on_demand)
      owner = nullptr;  // it is asked for its own
  }
  if (volume.description.geometry.size == Index3{}) {
    return Status::Unavailable(fmt::format("\"{}\": its owners are on other hosts", volume.field.dataset));
  }
  return std::shared_ptr<VolumeSource>(std::make_shared<OwnedSource>(std::move(volume), std::move(mapped), context));
}

}  // namespace slabstream
