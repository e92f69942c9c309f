#include "data/owned/process_memory.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/prctl.h>
#include <sys/uio.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <vector>

#include "common/files/file_descriptor.h"

namespace slabstream {
namespace {

constexpr std::size_t kMostFetched = std::size_t{1} << 17;  // bytes, so that they stay in a near cache until they are copied on
constexpr std::size_t kMostParts = 1024;                    // IOV_MAX
// Bytes between parts that are copied along rather than left out: a part costs the kernel as much time as about so many bytes.
constexpr std::int64_t kWorthwhileGap = 2048;

// Where a filter of system calls has no process_vm_readv, as in some containers.
bool FetchFromFile(std::uint32_t pid, std::span<const iovec> parts, std::byte* to) {
  const FileDescriptor memory(::open(fmt::format("/proc/{}/mem", pid).c_str(), O_RDONLY | O_CLOEXEC));
  for (const iovec& part : parts) {
    const auto at = reinterpret_cast<std::uint64_t>(part.iov_base);
    if (memory.number() < 0 || ReadBytesAt(memory.number(), at, {to, part.iov_len}) != part.iov_len) return false;
    to += part.iov_len;
  }
  return true;
}

// The parts, one after the other.
Status Fetch(std::uint32_t pid, std::span<const iovec> parts, std::span<std::byte> to) {
  while (!parts.empty()) {
    const std::span<const iovec> some = parts.first(std::min(parts.size(), kMostParts));
    std::size_t bytes = 0;
    for (const iovec& part : some) bytes += part.iov_len;
    const iovec local = {to.data(), bytes};
    const ssize_t read = ::process_vm_readv(pid_t(pid), &local, 1, some.data(), some.size(), 0);
    const int error = read < 0 ? errno : EFAULT;
    if (read != ssize_t(bytes) && !((error == EPERM || error == ENOSYS) && FetchFromFile(pid, some, to.data()))) {
      return Status::Unavailable(fmt::format("memory of process {} cannot be read: {}", pid, std::strerror(error)));
    }
    to = to.subspan(bytes);
    parts = parts.subspan(some.size());
  }
  return Status::Ok();
}

struct Copying {
  std::uint32_t pid;
  SampleType type;
  std::array<std::int64_t, 3> steps;
  std::array<Axis, 3> axes = kAxes;  // the fastest first
  std::vector<iovec> parts = {};
  std::vector<std::byte> fetched = {};

  Status Copy(std::uint64_t first, const Index3& count, const BoxRoom& to);
};

Status Copying::Copy(std::uint64_t first, const Index3& count, const BoxRoom& to) {
  const auto bytes = std::int64_t(BytesPerSample(type));
  std::int64_t run = 1;                        // samples from the first to the last one of a part
  std::array<std::int64_t, 3> packed = steps;  // those of what is fetched
  Index3 parted = Uniform(1);                  // parts along each axis
  for (const Axis axis : axes) {
    const auto i = std::size_t(Number(axis));
    if (CountIn(parted) == 1 && (steps[i] - run) * bytes <= kWorthwhileGap) {
      run += (count[axis] - 1) * steps[i];
    } else {
      packed[i] = run * std::int64_t(CountIn(parted));
      parted[axis] = count[axis];
    }
  }
  const auto runs = std::int64_t(CountIn(parted));
  if (const std::size_t all = std::size_t(run * runs * bytes); all > kMostFetched && count != Uniform(1)) {
    const Axis axis = *std::ranges::find_if(axes.rbegin(), axes.rend(), [&](Axis each) { return count[each] > 1; });
    Index3 lower = count, upper = count;
    lower[axis] = count[axis] / 2;
    upper[axis] -= lower[axis];
    if (Status status = Copy(first, lower, to); !status.ok()) return status;
    BoxRoom rest = to;
    const std::int64_t step = axis == Axis::kX ? 1 : axis == Axis::kY ? to.row : to.slice;
    rest.first += lower[axis] * step * std::int64_t(CopiedBytes(type, to.exact));
    return Copy(first + std::uint64_t(lower[axis] * steps[std::size_t(Number(axis))] * bytes), upper, rest);
  } else if (fetched.size() < all) {
    fetched.resize(all);
  }
  parts.clear();
  for (std::int64_t part = 0; part < runs; ++part) {
    std::int64_t sample = 0, rest = part;
    for (const Axis axis : axes) {
      sample += rest % parted[axis] * steps[std::size_t(Number(axis))];
      rest /= parted[axis];
    }
    parts.push_back({reinterpret_cast<void*>(first + std::uint64_t(sample * bytes)), std::size_t(run * bytes)});
  }
  if (Status status = Fetch(pid, parts, fetched); !status.ok()) return status;
  CopySamples(type, fetched.data(), packed, count, to);
  return Status::Ok();
}

}  // namespace

Status ReadProcessMemory(std::uint32_t pid, std::uint64_t address, std::span<std::byte> out) {
  const iovec part = {reinterpret_cast<void*>(address), out.size()};
  return Fetch(pid, {&part, 1}, out);
}

Status CopyProcessSamples(std::uint32_t pid, SampleType type, std::uint64_t first, const std::array<std::int64_t, 3>& steps,
                          const Index3& count, const BoxRoom& to) {
  Copying copying{pid, type, steps};
  std::ranges::stable_sort(copying.axes, {}, [&](Axis axis) { return steps[std::size_t(Number(axis))]; });
  return copying.Copy(first, count, to);
}

void LetProcessesReadMemory() { (void)::prctl(PR_SET_PTRACER, PR_SET_PTRACER_ANY, 0, 0, 0); }

}  // namespace slabstream
