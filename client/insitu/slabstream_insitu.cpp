#include "client/insitu/slabstream_insitu.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "client/owner/volume_owner.h"
#include "client/service/service_state.h"
#include "common/base/version.h"
#include "common/text/split.h"
#include "common/threads/guarded.h"
#include "data/sources/copy_samples.h"

using namespace slabstream;

static_assert(SLABSTREAM_INSITU_INVALID_ARGUMENT == int(StatusCode::kInvalidArgument) &&
              SLABSTREAM_INSITU_NOT_FOUND == int(StatusCode::kNotFound) && SLABSTREAM_INSITU_UNAVAILABLE == int(StatusCode::kUnavailable) &&
              SLABSTREAM_INSITU_RESOURCE_EXHAUSTED == int(StatusCode::kResourceExhausted) &&
              SLABSTREAM_INSITU_INTERNAL == int(StatusCode::kInternal));

namespace {

// The array of a box in a slot.
struct BoxArray {
  Index3 size;               // voxels
  std::uint64_t offset = 0;  // bytes to its first sample
  std::array<std::int64_t, 3> strides = {};
};

}  // namespace

struct slabstream_insitu {
  VolumeOwnerOptions options;
  std::vector<BoxArray> arrays;        // of options.layout.boxes
  std::vector<std::uint64_t> to_held;  // from start on: bytes from the first sample of each array to that of what is held
  std::string service;
  Context context;
  std::unique_ptr<VolumeOwner> owner;  // null before start; ends before the context
};

namespace {

thread_local std::array<char, 1024> last_error = {};  // no memory is needed to tell that there is none

template <class Work>
int Call(const char* what, Work&& work) {
  const Status status = Guarded(what, std::forward<Work>(work));
  if (!status.ok()) std::snprintf(last_error.data(), last_error.size(), "%s", status.message().c_str());
  return int(status.code());
}

Status Before(const slabstream_insitu* handle, const char* function) {
  if (handle == nullptr) return Status::InvalidArgument(fmt::format("{}: the handle is NULL", function));
  if (handle->owner) return Status::InvalidArgument(fmt::format("{} stands behind start", function));
  return Status::Ok();
}

Status After(const slabstream_insitu* handle, const char* function) {
  if (handle == nullptr) return Status::InvalidArgument(fmt::format("{}: the handle is NULL", function));
  if (!handle->owner) return Status::InvalidArgument(fmt::format("{} stands before start", function));
  return Status::Ok();
}

Index3 IndexOf(const std::int32_t* xyz) { return {xyz[0], xyz[1], xyz[2]}; }
Vec3 VectorOf(const double* xyz) { return {xyz[0], xyz[1], xyz[2]}; }

Status NotOnDemand(const slabstream_insitu& handle, const char* function) {
  if (handle.options.make == nullptr) return Status::Ok();
  return Status::InvalidArgument(fmt::format("{}: boxes are made on demand, and adopt commits a time", function));
}

Result<VolumeOwner::Slot> Begin(slabstream_insitu& handle, double timeout_seconds) {
  if (!(timeout_seconds >= 0)) return Status::InvalidArgument(fmt::format("timeout of {} s, must be at least 0", timeout_seconds));
  constexpr double kForever = 1e9;  // seconds, as nanoseconds within 64 bits
  return handle.owner->Begin(Duration(std::int64_t(1e9 * std::min(timeout_seconds, kForever))));
}

// Gives the array the next place in the slot. INVALID_ARGUMENT, RESOURCE_EXHAUSTED: the layout stays as it was.
Status Place(OwnerLayout& layout, std::vector<BoxArray>& arrays, const Box& box, const Box& array, const std::int64_t* strides) {
  constexpr std::uint64_t kLine = 64;  // of the cache
  constexpr std::int64_t kMostStride = std::int64_t{1} << 40;
  const auto wrong = [&](const std::string& what) { return Status::InvalidArgument(fmt::format("box {}: {}", arrays.size(), what)); };
  const Box bounds = {{0, 0, 0}, layout.size}, near = {Uniform(-kMaxVolumeSide), layout.size + Uniform(kMaxVolumeSide)};
  if (box.empty() || !bounds.Contains(box)) return wrong("it is empty, or not inside the field");
  if (!array.Contains(box) || !near.Contains(array)) return wrong("its array does not hold it, or reaches too far");
  BoxArray placed{.size = array.size()};
  placed.strides = {1, placed.size.x, std::int64_t{placed.size.x} * placed.size.y};
  if (strides != nullptr) std::copy_n(strides, 3, placed.strides.begin());
  const auto samples_to = [&](const Index3& voxel) {
    return std::uint64_t(voxel.x * placed.strides[0] + voxel.y * placed.strides[1] + voxel.z * placed.strides[2]);
  };
  for (const std::int64_t stride : placed.strides) {
    if (stride < 1 || stride > kMostStride) return wrong(fmt::format("a stride of {}, must be in [1, {}]", stride, kMostStride));
  }
  const std::uint64_t sample_bytes = BytesPerSample(layout.samples);
  const std::uint64_t bytes = (samples_to(placed.size - Uniform(1)) + 1) * sample_bytes;
  placed.offset = (layout.slot_bytes + kLine - 1) / kLine * kLine;
  if (bytes > kMostOwnerBytes || placed.offset + bytes > kMostOwnerBytes) {
    return Status::ResourceExhausted(
        fmt::format("box {}: {} bytes after {}, limit {}", arrays.size(), bytes, placed.offset, kMostOwnerBytes));
  }
  const Box held = Intersection(array, bounds);
  layout.boxes.push_back({box, held, placed.offset + samples_to(held.begin - array.begin) * sample_bytes, placed.strides});
  layout.slot_bytes = placed.offset + bytes;
  arrays.push_back(placed);
  return Status::Ok();
}

void Copy(SampleType samples, const BoxArray& array, const std::byte* from, std::span<const std::int64_t, 3> steps, std::byte* to) {
  const std::array<std::int32_t, 3> count = {array.size.x, array.size.y, array.size.z};
  std::array<std::size_t, 3> axes = {0, 1, 2};  // that which is dense in `to` comes first, as CopySamples has it
  std::ranges::stable_sort(axes, {}, [&](std::size_t axis) { return array.strides.at(axis); });
  const auto [fast, row, slice] = axes;
  const std::int32_t runs = array.strides.at(fast) == 1 ? 1 : count.at(fast);  // none is dense: sample by sample along it
  const auto bytes = std::int64_t(BytesPerSample(samples));
  for (std::int32_t i = 0; i < runs; ++i) {
    CopySamples(samples, from + i * steps[fast] * bytes, {steps[fast], steps[row], steps[slice]},
                {count.at(fast) / runs, count.at(row), count.at(slice)},
                {to + i * array.strides.at(fast) * bytes, array.strides.at(row), array.strides.at(slice), false, true});
  }
}

}  // namespace

int slabstream_insitu_open(slabstream_insitu** handle, const slabstream_insitu_field* field) {
  return Call("open", [&] {
    if (handle == nullptr || field == nullptr) return Status::InvalidArgument("open: an argument is NULL");
    *handle = nullptr;
    const std::string samples = field->samples == nullptr ? "" : field->samples;
    const std::optional<SampleType> type = SampleTypeNamed(samples);
    if (!type) return Status::InvalidArgument(fmt::format("samples is '{}', must be one of: {}", samples, SampleTypeNames()));
    auto opened = std::make_unique<slabstream_insitu>();
    VolumeOwnerOptions& options = opened->options;
    options.dataset = field->dataset == nullptr ? "" : field->dataset;
    options.owner = field->owner;
    options.owners = std::max(field->owners, 1U);
    if (const std::string_view fields = field->fields == nullptr ? "" : field->fields; !fields.empty()) {
      for (const std::string_view name : Split(fields, ',')) options.fields.emplace_back(name);
    }
    options.field = field->field;
    VolumeGeometry& geometry = options.description.geometry;
    geometry.size = IndexOf(field->size);
    if (const Vec3 spacing = VectorOf(field->spacing); spacing != Vec3{}) geometry.spacing = spacing;
    geometry.orientation.world = World::kScene;
    geometry.orientation.origin = VectorOf(field->origin);
    options.layout.samples = *type;
    options.layout.size = geometry.size;
    options.layout.slots = field->slots == 0 ? 3 : field->slots;
    if (Status status = options.layout.Check(); !status.ok()) return status;
    opened->service = field->service == nullptr ? "" : field->service;
    *handle = opened.release();
    return Status::Ok();
  });
}

int slabstream_insitu_add_box(slabstream_insitu* handle, const int32_t begin[3], const int32_t end[3], const int32_t array_begin[3],
                              const int32_t array_end[3], const int64_t strides[3]) {
  return Call("add_box", [&] {
    if (Status status = Before(handle, "add_box"); !status.ok()) return status;
    if (begin == nullptr || end == nullptr || (array_begin == nullptr) != (array_end == nullptr)) {
      return Status::InvalidArgument("add_box: begin, end, or one of array_begin and array_end is NULL");
    }
    const Box box = {IndexOf(begin), IndexOf(end)};
    const Box array = array_begin == nullptr ? box : Box{IndexOf(array_begin), IndexOf(array_end)};
    return Place(handle->options.layout, handle->arrays, box, array, strides);
  });
}

int slabstream_insitu_parameter(slabstream_insitu* handle, const char* name, double least, double most, double value) {
  return Call("parameter", [&] {
    if (Status status = Before(handle, "parameter"); !status.ok()) return status;
    handle->options.parameters.push_back({name == nullptr ? "" : name, least, most, value});
    return Status::Ok();
  });
}

int slabstream_insitu_on_demand(slabstream_insitu* handle, const slabstream_insitu_maker* maker) {
  return Call("on_demand", [&] {
    if (Status status = Before(handle, "on_demand"); !status.ok()) return status;
    if (maker == nullptr || maker->make == nullptr || maker->drop == nullptr) {
      return Status::InvalidArgument("on_demand: maker, make or drop is NULL");
    }
    handle->options.made_bytes = maker->most_bytes;
    handle->options.make = [handle, maker = *maker](std::size_t box, std::uint64_t time) -> Result<MadeBox> {
      const void* samples = nullptr;
      std::array<char, 1024> error = {};
      const int code = maker.make(maker.context, std::uint32_t(box), time, &samples, error.data(), std::uint32_t(error.size()));
      error.back() = '\0';
      if (code < 0 || code >= kStatusCodeCount) return Status::Internal(fmt::format("make returned {}, which is no code", code));
      if (code != 0) return Status(StatusCode(code), error.data());
      if (samples == nullptr) return Status::Internal(fmt::format("make gave no samples of box {}", box));
      // What is held of it begins behind ghosts outside the field.
      const std::uint64_t to_held = handle->to_held[box];
      return MadeBox(static_cast<const std::byte*>(samples) + to_held,
                     [maker, box, time, samples](const std::byte*) { maker.drop(maker.context, std::uint32_t(box), time, samples); });
    };
    return Status::Ok();
  });
}

int slabstream_insitu_start(slabstream_insitu* handle) {
  return Call("start", [&] {
    if (Status status = Before(handle, "start"); !status.ok()) return status;
    Result<ServiceChoice> service = ResolveOwnerService(handle->service);
    if (!service.ok()) return service.status();
    handle->to_held.clear();
    for (std::size_t i = 0; i < handle->arrays.size(); ++i) {
      handle->to_held.push_back(handle->options.layout.boxes[i].offset - handle->arrays[i].offset);
    }
    VolumeOwnerOptions options = handle->options;
    options.endpoint = service->endpoint;
    options.service_file = service->file;
    if (options.owner != 0 || options.field != 0) options.parameters.clear();
    Result<std::unique_ptr<VolumeOwner>> owner = VolumeOwner::Start(handle->context, std::move(options));
    if (!owner.ok()) return owner.status();
    handle->owner = *std::move(owner);
    return Status::Ok();
  });
}

int slabstream_insitu_begin(slabstream_insitu* handle, double timeout_seconds, void** pointers, double* waited_seconds) {
  return Call("begin", [&] {
    if (Status status = After(handle, "begin"); !status.ok()) return status;
    if (Status status = NotOnDemand(*handle, "begin"); !status.ok()) return status;
    if (pointers == nullptr && !handle->arrays.empty()) return Status::InvalidArgument("begin: pointers is NULL");
    const Result<VolumeOwner::Slot> slot = Begin(*handle, timeout_seconds);
    if (!slot.ok()) return slot.status();
    for (const BoxArray& array : handle->arrays) *pointers++ = slot->bytes.data() + array.offset;
    if (waited_seconds != nullptr) *waited_seconds = std::chrono::duration<double>(slot->waited).count();
    return Status::Ok();
  });
}

int slabstream_insitu_commit(slabstream_insitu* handle, uint64_t time, double simulated) {
  return Call("commit", [&] {
    if (Status status = After(handle, "commit"); !status.ok()) return status;
    return handle->owner->Commit(time, simulated);
  });
}

int slabstream_insitu_publish(slabstream_insitu* handle, uint64_t time, double simulated, const void* const* pointers,
                              const int64_t (*strides)[3], double timeout_seconds) {
  return Call("publish", [&] {
    if (Status status = After(handle, "publish"); !status.ok()) return status;
    if (Status status = NotOnDemand(*handle, "publish"); !status.ok()) return status;
    const std::vector<BoxArray>& arrays = handle->arrays;
    for (std::size_t i = 0; i < arrays.size(); ++i) {
      if (pointers == nullptr || pointers[i] == nullptr) return Status::InvalidArgument(fmt::format("publish: pointer {} is NULL", i));
    }
    const Result<VolumeOwner::Slot> slot = Begin(*handle, timeout_seconds);
    if (!slot.ok()) return slot.status();
    for (std::size_t i = 0; i < arrays.size(); ++i) {
      const std::span<const std::int64_t, 3> steps = strides == nullptr ? std::span(arrays[i].strides) : std::span(strides[i]);
      Copy(handle->options.layout.samples, arrays[i], static_cast<const std::byte*>(pointers[i]), steps,
           slot->bytes.data() + arrays[i].offset);
    }
    return handle->owner->Commit(time, simulated);
  });
}

int slabstream_insitu_adopt(slabstream_insitu* handle, uint64_t time, double simulated, const void* const* pointers, double timeout_seconds,
                            uint64_t* freed) {
  return Call("adopt", [&] {
    if (Status status = After(handle, "adopt"); !status.ok()) return status;
    std::vector<const std::byte*> arrays;
    for (std::size_t i = 0; handle->options.make == nullptr && i < handle->arrays.size(); ++i) {
      if (pointers == nullptr || pointers[i] == nullptr) return Status::InvalidArgument(fmt::format("adopt: pointer {} is NULL", i));
      arrays.push_back(static_cast<const std::byte*>(pointers[i]) + handle->to_held[i]);
    }
    const Result<VolumeOwner::Slot> slot = Begin(*handle, timeout_seconds);
    if (!slot.ok()) return slot.status();
    if (freed != nullptr) *freed = slot->freed;
    return handle->owner->Commit(time, simulated, arrays);
  });
}

int slabstream_insitu_poll(slabstream_insitu* handle, int* looked_at, double* values) {
  return Call("poll", [&] {
    if (Status status = After(handle, "poll"); !status.ok()) return status;
    if (looked_at != nullptr) *looked_at = handle->owner->looked_at() ? 1 : 0;
    if (values == nullptr) return Status::Ok();
    if (handle->options.owner == 0) {
      std::ranges::copy(handle->owner->parameters(), values);
    } else {
      std::ranges::transform(handle->options.parameters, values, &SteeredParameter::value);
    }
    return Status::Ok();
  });
}

void slabstream_insitu_close(slabstream_insitu* handle) { delete handle; }

const char* slabstream_insitu_error(void) { return last_error.data(); }

const char* slabstream_insitu_version(void) { return Version().data(); }
