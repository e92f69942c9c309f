#include "data/sources/chunked_source.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <exception>
#include <mutex>
#include <unordered_map>
#include <unordered_set>
#include <utility>

#include "common/base/check.h"
#include "common/base/log.h"
#include "common/base/printable.h"
#include "common/text/url.h"
#include "common/volume/memory_budget.h"
#include "data/sources/box_reading.h"
#include "data/sources/copy_samples.h"

namespace slabstream {
namespace {

// What is known of the chunks of all levels.
struct Findings {
  std::atomic<bool> settled = false;  // one is there, or a warning has said that there is none
};

// A level, which lives as long as the source or a read of it. A chunk that several reads need at a time is read once: it has one flight,
// for which all of them wait.
class Level : public std::enable_shared_from_this<Level> {
 public:
  Level(std::string name, PyramidLevel level, const Index3& size, SourceContext context, std::shared_ptr<Findings> findings)
      : name_(std::move(name)),
        server_(ServerOf(name_)),
        level_(std::move(level)),
        size_(size),
        context_(std::move(context)),
        findings_(std::move(findings)),
        owner_(context_->cache().NewOwner()) {
    const ArrayShape& shape = level_.array->shape();
    for (std::size_t a = 0; a < shape.size.size(); ++a) index_.push_back(level_.at[a] / shape.chunk[a]);
    for (int axis = 0; axis < 3; ++axis) {
      const int a = level_.axes[std::size_t(axis)];
      const std::int32_t side = size_[axis];
      // A chunk may be longer than the level.
      chunk_[axis] = a < 0 ? 1 : std::int32_t(std::min(shape.chunk[std::size_t(a)], std::uint64_t(side)));
    }
    counts_ = {(size_.x - 1) / chunk_.x + 1, (size_.y - 1) / chunk_.y + 1, (size_.z - 1) / chunk_.z + 1};
    std::array<std::byte, sizeof(float)> fill{};
    CopySamples(shape.type, shape.fill.data(), {0, 0, 0}, {1, 1, 1}, {fill.data(), 1, 1});
    fills_with_zeros_ = std::ranges::all_of(fill, [](std::byte each) { return each == std::byte{0}; });
  }
  ~Level() { context_->cache().Forget(owner_); }

  // The same level at another time and channel, of which it has so many. Null: these are no axes of its array.
  std::shared_ptr<Level> At(const SourceInfo& of, int time, int channel) const {
    PyramidLevel level = level_;
    const auto set = [&](int axis, int from, int to, std::size_t count) {
      if (axis >= 0 && level.array->shape().size[std::size_t(axis)] == count) {
        level.at[std::size_t(axis)] = std::uint64_t(to);
        return true;
      }
      return from == to;
    };
    const bool is_there = set(level.time_axis, of.time, time, std::size_t(of.times.count)) &&
                          set(level.channel_axis, of.channel, channel, std::max<std::size_t>(of.channels.size(), 1));
    return is_there ? std::make_shared<Level>(name_, std::move(level), size_, context_, findings_) : nullptr;
  }

  const Index3& chunk() const { return chunk_; }
  VolumeSource::Counts counts() const { return {stored_bytes_, chunks_}; }

  void Read(const std::shared_ptr<BoxReading>& reading) {
    const Box box = Mirrored(reading->box());
    const Index3 first = {box.begin.x / chunk_.x, box.begin.y / chunk_.y, box.begin.z / chunk_.z};
    const Index3 last = {(box.end.x - 1) / chunk_.x, (box.end.y - 1) / chunk_.y, (box.end.z - 1) / chunk_.z};
    // In the order of the array's axes, in which stores keep chunks: the last axis varies fastest.
    std::array<int, 3> order = {0, 1, 2};
    std::ranges::sort(order, {}, [&](int axis) { return level_.axes[std::size_t(axis)]; });
    const auto from = [&](int n) { return first[order[std::size_t(n)]]; };
    const auto to = [&](int n) { return last[order[std::size_t(n)]]; };
    Index3 chunk;
    for (std::int32_t i = from(0); i <= to(0); ++i) {
      for (std::int32_t j = from(1); j <= to(1); ++j) {
        for (std::int32_t k = from(2); k <= to(2); ++k) {
          if (!reading->goes_on()) return reading->GiveUp();
          chunk[order[0]] = i;
          chunk[order[1]] = j;
          chunk[order[2]] = k;
          Want(chunk, reading);
        }
      }
    }
  }

 private:
  using Readings = std::vector<std::shared_ptr<BoxReading>>;

  // Of elements of the array.
  Box BoxOf(const Index3& chunk) const { return {chunk * chunk_, Min((chunk + Uniform(1)) * chunk_, size_)}; }

  // From voxels of the level to elements of the array along x, y and z, and back.
  Box Mirrored(Box box) const {
    for (int axis = 0; axis < 3; ++axis) {
      if (!level_.mirrored[std::size_t(axis)]) continue;
      box.begin[axis] = size_[axis] - std::exchange(box.end[axis], size_[axis] - box.begin[axis]);
    }
    return box;
  }

  void Want(const Index3& chunk, const std::shared_ptr<BoxReading>& reading) {
    const std::uint64_t number = NumberIn(counts_, chunk);
    {
      const std::lock_guard lock(mutex_);
      const auto flight = flights_.find(number);
      if (flight != flights_.end()) {
        flight->second.push_back(reading);
        return reading->BeginPart();
      }
      if (std::optional<Bytes> elements = context_->cache().Find(owner_, number)) {
        // Not on the thread of whoever reads: copies of many chunks take long.
        std::function<void()> copy = [self = shared_from_this(), chunk, reading, elements = *std::move(elements)] {
          self->Copy(chunk, elements, *reading);
          reading->EndPart();
        };
        reading->BeginPart();
        try {
          context_->PostDecode(std::move(copy));
        } catch (const std::exception& error) {
          reading->Fail(OutOfMemory(error));
          reading->EndPart();
        }
        return;
      }
      flights_.try_emplace(number, Readings{reading});
      reading->BeginPart();
    }
    const std::uint64_t bytes = 2 * level_.array->shape().chunk_bytes();  // packed and decoded
    // More than chunks may take together: one may be under way all the same, if there is memory for it.
    constexpr std::uint64_t kLarge = std::uint64_t{128} << 20;
    if (Status fits = bytes > kLarge ? CheckFitsMemory(std::int64_t(bytes), name_ + ": a chunk") : Status::Ok(); !fits.ok()) {
      return End(chunk, TakeFlight(chunk), fits);
    }
    try {
      context_->Admit(
          bytes, [self = shared_from_this(), chunk, bytes] { self->Begin(chunk, bytes); }, server_);
    } catch (const std::exception& error) {
      End(chunk, TakeFlight(chunk), OutOfMemory(error));
    }
  }

  // Throws nothing.
  void Begin(const Index3& chunk, std::uint64_t bytes) {
    if (const Readings nobody = TakeFlightIfUnwanted(chunk); !nobody.empty()) {
      End(chunk, nobody, Status::Cancelled("reading was stopped"));
      return context_->Release(bytes, server_);
    }
    try {
      auto land = [self = shared_from_this(), chunk, bytes](Result<std::optional<StoredChunk>> read) {
        // Somebody may have come for it since nobody wanted it.
        if (read.status().code() == StatusCode::kCancelled && self->IsWanted(chunk)) return self->Begin(chunk, bytes);
        self->Land(chunk, std::move(read));
        self->context_->Release(bytes, self->server_);
      };
      level_.array->ReadChunk(IndexOf(chunk), std::move(land), [self = shared_from_this(), chunk] { return self->IsWanted(chunk); });
    } catch (const std::exception& error) {
      End(chunk, TakeFlight(chunk), OutOfMemory(error));
      context_->Release(bytes, server_);
    }
  }

  bool IsWanted(const Index3& chunk) {
    const std::lock_guard lock(mutex_);
    const auto flight = flights_.find(NumberIn(counts_, chunk));
    return flight != flights_.end() && IsWanted(flight->second);
  }
  static bool IsWanted(const Readings& flight) {
    return std::ranges::any_of(flight, [](const auto& each) { return each->goes_on(); });
  }

  // Along all axes of the array.
  std::vector<std::uint64_t> IndexOf(const Index3& chunk) const {
    std::vector<std::uint64_t> index = index_;
    for (int axis = 0; axis < 3; ++axis) {
      const int a = level_.axes[std::size_t(axis)];
      if (a >= 0) index[std::size_t(a)] = std::uint64_t(chunk[axis]);
    }
    return index;
  }

  // A volume of which no chunk is there is rather an incomplete copy than an empty one. Nothing is read to find that out.
  void NoteMissing(const Index3& chunk) try {
    constexpr std::uint64_t kMostNoted = std::uint64_t{1} << 16;
    const std::uint64_t count = std::uint64_t(counts_.x) * std::uint64_t(counts_.y) * std::uint64_t(counts_.z);
    if (findings_->settled || count > kMostNoted) return;
    {
      const std::lock_guard lock(mutex_);
      missing_.insert(NumberIn(counts_, chunk));
      if (missing_.size() < count) return;
    }
    const std::string object = level_.array->NameOf(IndexOf(Index3{}));
    if (object.empty() || findings_->settled.exchange(true)) return;
    LogWarning(Printable(fmt::format("{}: no chunk was found, so that all voxels have the fill value; looked for {}{}", name_, object,
                                     count > 1 ? fmt::format(" and {} others", count - 1) : "")));
  } catch (const std::exception&) {  // no memory: nothing is said
  }

  void Land(const Index3& chunk, Result<std::optional<StoredChunk>> read) {
    Status status = read.status();
    if (status.ok() && *read) findings_->settled = true;
    if (status.ok() && !*read) NoteMissing(chunk);
    Bytes elements;
    const ArrayShape& shape = level_.array->shape();
    if (status.ok() && *read) {
      elements = std::move((*read)->elements);
      stored_bytes_ += (*read)->stored_bytes;
      ++chunks_;
      std::uint64_t bytes = BytesPerSample(shape.type);
      for (const std::uint64_t along : ShapeOf(chunk)) bytes *= along;
      if (elements.size() != bytes) {
        status = Status::DataLoss(fmt::format("{}: a chunk has {} bytes, expected {}", name_, elements.size(), bytes));
      }
    }
    End(chunk, TakeFlight(chunk, status.ok() ? elements : Bytes()), status, elements);
  }

  // Ends the flight. A chunk of which no read took all may be needed again, or one of a small level behind an address, which would be
  // another request: it goes to the cache, before later reads find that it has no flight.
  Readings TakeFlight(const Index3& chunk, const Bytes& elements = {}) {
    const std::lock_guard lock(mutex_);
    const auto flight = flights_.find(NumberIn(counts_, chunk));
    const Box all = Mirrored(BoxOf(chunk));
    const bool is_small = !server_.empty() && CountIn(size_) * BytesPerSample(level_.array->shape().type) <= context_->small_bytes();
    const bool is_taken = std::ranges::any_of(flight->second, [&](const auto& each) { return each->box().Contains(all); });
    if (!elements.empty() && (is_small || !is_taken)) {
      try {
        context_->cache().Keep(owner_, flight->first, elements);
      } catch (const std::exception&) {  // no memory: it is read again
      }
    }
    Readings readings = std::move(flight->second);
    flights_.erase(flight);
    return readings;
  }

  Readings TakeFlightIfUnwanted(const Index3& chunk) {
    const std::lock_guard lock(mutex_);
    const auto flight = flights_.find(NumberIn(counts_, chunk));
    if (IsWanted(flight->second)) return {};
    Readings readings = std::move(flight->second);
    flights_.erase(flight);
    return readings;
  }

  // `elements`: empty if there is no such chunk.
  void End(const Index3& chunk, const Readings& readings, const Status& status, const Bytes& elements = {}) {
    for (const std::shared_ptr<BoxReading>& reading : readings) {
      if (status.ok()) {
        Copy(chunk, elements, *reading);
      } else {
        reading->Fail(status);
      }
      reading->EndPart();
    }
  }

  // Elements along each axis that a chunk has in its store; 1 behind the last axis.
  std::array<std::uint64_t, kMaxArrayAxes> ShapeOf(const Index3& chunk) const {
    const ArrayShape& shape = level_.array->shape();
    std::array<std::uint64_t, kMaxArrayAxes> sides;
    sides.fill(1);
    std::ranges::copy(shape.chunk, sides.begin());
    if (!shape.cut_at_end) return sides;
    for (std::size_t a = 0; a < shape.size.size(); ++a) {
      std::uint64_t index = index_[a];
      for (int axis = 0; axis < 3; ++axis) {
        if (level_.axes[std::size_t(axis)] == int(a)) index = std::uint64_t(chunk[axis]);
      }
      sides[a] = std::min(sides[a], shape.size[a] - index * shape.chunk[a]);
    }
    return sides;
  }

  void Copy(const Index3& chunk, const Bytes& elements, BoxReading& reading) const {
    if (!reading.goes_on()) return reading.GiveUp();
    if (elements.empty() && fills_with_zeros_ && reading.out().zeroed && !reading.out().exact) return;
    const ArrayShape& shape = level_.array->shape();
    const Box stored = Intersection(BoxOf(chunk), Mirrored(reading.box())), part = Mirrored(stored);
    const std::byte* from = shape.fill.data();
    std::array<std::int64_t, 3> steps = {0, 0, 0};
    if (!elements.empty()) {
      const std::array<std::uint64_t, kMaxArrayAxes> sides = ShapeOf(chunk);
      const Index3 within = stored.begin - BoxOf(chunk).begin;
      std::int64_t step = 1, first = 0;
      for (std::size_t a = shape.size.size(); a-- > 0; step *= std::int64_t(sides[a])) {
        std::int64_t place = std::int64_t(level_.at[a] % shape.chunk[a]);
        for (int axis = 0; axis < 3; ++axis) {
          if (level_.axes[std::size_t(axis)] != int(a)) continue;
          const bool mirrored = level_.mirrored[std::size_t(axis)];
          place = within[axis] + (mirrored ? part.size()[axis] - 1 : 0);
          steps[std::size_t(axis)] = mirrored ? -step : step;
        }
        first += place * step;
      }
      from = elements.span().data() + first * std::int64_t(BytesPerSample(shape.type));
    }
    BoxRoom out = reading.out();
    const Index3 offset = part.begin - reading.box().begin;
    out.first += (offset.x + offset.y * out.row + offset.z * out.slice) * std::int64_t(CopiedBytes(shape.type, out.exact));
    CopySamples(shape.type, from, steps, part.size(), out);
  }

  Status OutOfMemory(const std::exception& error) const {
    return Status::ResourceExhausted(fmt::format("{}: a chunk cannot be read: {}", name_, error.what()));
  }

  const std::string name_;
  const std::string server_;  // empty: it lies in files
  const PyramidLevel level_;
  Index3 size_;
  const SourceContext context_;
  const std::shared_ptr<Findings> findings_;
  const ChunkCache::Owner owner_;
  Index3 chunk_, counts_;             // voxels of a chunk, and chunks, along each axis
  std::vector<std::uint64_t> index_;  // of chunks along the other axes of the array
  bool fills_with_zeros_ = false;     // kept ones, where there is no chunk
  std::atomic<std::uint64_t> stored_bytes_ = 0, chunks_ = 0;
  std::mutex mutex_;                                     // guards what follows
  std::unordered_map<std::uint64_t, Readings> flights_;  // who waits, by the number of the chunk
  std::unordered_set<std::uint64_t> missing_;            // chunks, as long as none was found
};

class ChunkedSource : public VolumeSource {
 public:
  ChunkedSource(std::string name, SourceInfo info, std::vector<std::shared_ptr<Level>> levels)
      : name_(std::move(name)), info_(std::move(info)), levels_(std::move(levels)) {}

  const SourceInfo& info() const override { return info_; }

  std::shared_ptr<VolumeSource> At(int time, int channel) override {
    const int channels = std::max(int(info_.channels.size()), 1);
    if (std::min(time, channel) < 0 || time >= info_.times.count || channel >= channels) return nullptr;
    SourceInfo info = info_;
    info.time = time;
    info.channel = channel;
    info.growth = nullptr;
    std::vector<std::shared_ptr<Level>> levels;
    for (const std::shared_ptr<Level>& level : levels_) {
      levels.push_back(level->At(info_, time, channel));
      if (levels.back() == nullptr) return nullptr;
    }
    return std::make_shared<ChunkedSource>(name_, std::move(info), std::move(levels));
  }

  void Read(int level, const Box& box, const BoxRoom& out, std::stop_token stop, ReadDone done) override {
    const VolumeDescription& description = info_.levels.at(std::size_t(level)).description;
    CHECK(!box.empty() && description.geometry.bounds().Contains(box));
    const auto reading = std::make_shared<BoxReading>(box, out, std::move(stop), std::move(done));
    try {
      levels_[std::size_t(level)]->Read(reading);
    } catch (const std::exception& error) {
      reading->Fail(Status::ResourceExhausted(fmt::format("{}: cannot be read: {}", name_, error.what())));
    }
    reading->EndPart();
  }

  Counts counts() const override {
    Counts all;
    for (const std::shared_ptr<Level>& level : levels_) all += level->counts();
    return all;
  }

 private:
  const std::string name_;
  const SourceInfo info_;
  const std::vector<std::shared_ptr<Level>> levels_;
};

// What the type says about a shape, and that its chunks are no larger than promised. A format has made it of what a file says.
Status CheckShape(const std::string& name, const PyramidLevel& level) {
  const ArrayShape& shape = level.array->shape();
  CHECK(!shape.size.empty() && shape.size.size() <= kMaxArrayAxes && shape.chunk.size() == shape.size.size());
  CHECK(level.at.size() == shape.size.size() && shape.fill.size() == BytesPerSample(shape.type));
  for (const int a : level.axes) CHECK(a < int(shape.size.size()) && (a < 0 || std::ranges::count(level.axes, a) == 1));
  std::uint64_t left = kMostChunkBytes / BytesPerSample(shape.type);
  for (const std::uint64_t along : shape.chunk) {
    if (along == 0 || along > left) {
      return Status::InvalidArgument(
          fmt::format("{}: chunks of {} elements, more than {} MiB", name, fmt::join(shape.chunk, " x "), kMostChunkBytes >> 20));
    }
    left /= along;
  }
  return Status::Ok();
}

Result<VolumeGeometry> GeometryOf(const std::string& name, const Pyramid& pyramid, const PyramidLevel& level) {
  const ArrayShape& shape = level.array->shape();
  VolumeGeometry geometry{.spacing = level.spacing, .orientation = pyramid.orientation};
  geometry.orientation.origin = level.origin;
  for (int axis = 0; axis < 3; ++axis) {
    const int a = level.axes[std::size_t(axis)];
    const std::uint64_t side = a < 0 ? 1 : shape.size[std::size_t(a)];
    if (side < 1 || side > std::uint64_t(kMaxVolumeSide)) {
      return Status::InvalidArgument(fmt::format("{}: {} voxels along {}, expected from 1 to {}", name, side,
                                                 std::string_view("xyz").substr(std::size_t(axis), 1), kMaxVolumeSide));
    }
    geometry.size[axis] = std::int32_t(side);
  }
  for (const double spacing : {level.spacing.x, level.spacing.y, level.spacing.z}) {
    if (!(spacing > 0) || !std::isfinite(spacing)) {
      return Status::InvalidArgument(fmt::format("{}: a spacing of {}, expected a finite number above 0", name, spacing));
    }
  }
  return geometry;
}

// What is noted of a chunk that is read takes more than a small one. With many of them it would be memory and time for nothing.
Status CheckChunks(const std::string& name, const Index3& size, const Index3& chunk, std::uint64_t chunk_bytes) {
  constexpr std::uint64_t kSmallBytes = 64, kMostSmall = std::uint64_t{1} << 20;
  const std::uint64_t count = CountIn((size - Uniform(1)) / chunk + Uniform(1));
  if (chunk_bytes >= kSmallBytes || count <= kMostSmall) return Status::Ok();
  return Status::InvalidArgument(fmt::format("{}: {} chunks of {} byte{}: of chunks of less than {} bytes at most {} are read", name, count,
                                             chunk_bytes, chunk_bytes == 1 ? "" : "s", kSmallBytes, kMostSmall));
}

}  // namespace

Result<std::shared_ptr<VolumeSource>> MakeChunkedSource(const std::string& name, Pyramid pyramid, const SourceContext& context) {
  if (pyramid.levels.empty()) return Status::InvalidArgument(name + ": has no level");
  const SampleType type = pyramid.levels.front().array->shape().type;
  const KeptType kept = KeptTypeOf(type);
  const ValueMapping mapping = {pyramid.rescale.scale, pyramid.rescale.FromStored(kept.shift)};
  SourceInfo info = std::move(pyramid.info);
  if (info.file_type.empty()) info.file_type = ToString(type);
  info.exact = {type, pyramid.rescale};
  info.levels.clear();
  std::vector<std::shared_ptr<Level>> levels;
  const auto findings = std::make_shared<Findings>();
  for (PyramidLevel& level : pyramid.levels) {
    const std::string level_name = levels.empty() ? name : fmt::format("{}: level {}", name, levels.size());
    const SampleType its_type = level.array->shape().type;
    if (its_type != type) {
      return Status::InvalidArgument(
          fmt::format("{}: samples of type {}, but {} at level 0", level_name, ToString(its_type), ToString(type)));
    }
    if (Status status = CheckShape(level_name, level); !status.ok()) return status;
    const Result<VolumeGeometry> geometry = GeometryOf(level_name, pyramid, level);
    if (!geometry.ok()) return geometry.status();
    const std::uint64_t chunk_bytes = level.array->shape().chunk_bytes();
    levels.push_back(std::make_shared<Level>(level_name, std::move(level), geometry->size, context, findings));
    if (Status status = CheckChunks(level_name, geometry->size, levels.back()->chunk(), chunk_bytes); !status.ok()) return status;
    info.levels.push_back({{*geometry, kept.type, mapping}, levels.back()->chunk()});
  }
  return std::shared_ptr<VolumeSource>(std::make_shared<ChunkedSource>(name, std::move(info), std::move(levels)));
}

}  // namespace slabstream
