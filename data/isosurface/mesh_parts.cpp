#include "data/isosurface/mesh_parts.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>

#include <algorithm>
#include <cinttypes>
#include <cstdio>
#include <optional>
#include <utility>

#include "common/files/file_descriptor.h"
#include "common/files/file_lock.h"
#include "data/isosurface/surface_maker.h"

namespace slabstream {
namespace {

constexpr std::size_t kReadAtOnce = std::size_t{1} << 18;  // vertices or triangles
constexpr std::size_t kMostHead = 1024;

// What the head tells first: numbers follow.
std::string TitleOf(const MeshOf& of, const SurfaceShare& share) {
  return fmt::format("slabstream part {} of {} of a surface\n{}\n{}\n{}\n", share.part, share.parts, of.surface, of.world, of.level);
}

// A part that is there.
class Part {
 public:
  // Nothing: there is none, or it is of another surface, or cut off.
  static std::optional<Part> Open(const std::string& path, const MeshOf& of, const SurfaceShare& share) {
    Part part(path);
    std::string head(kMostHead, '\0');
    head.resize(ReadBytesAt(part.file_.number(), 0, std::as_writable_bytes(std::span(head))));
    const std::string title = TitleOf(of, share);
    if (!head.starts_with(title)) return std::nullopt;
    int more = 0;
    if (std::sscanf(head.c_str() + title.size(), "%" SCNu64 " %" SCNu64 " %" SCNu64 "\n%n", &part.vertices_, &part.triangles_,
                    &part.last_slice_, &more) != 3 ||
        more == 0) {
      return std::nullopt;
    }
    part.begin_ = title.size() + std::size_t(more);
    struct stat found {};
    const bool counts = std::max({part.vertices_, part.triangles_, part.last_slice_}) <= kMostElements;
    const bool whole = counts && ::fstat(part.file_.number(), &found) == 0 && std::uint64_t(found.st_size) == part.EndOf();
    return whole ? std::optional(std::move(part)) : std::nullopt;
  }

  std::uint64_t vertices() const { return vertices_; }
  // Each calls take(some of them) until all were taken. Cancelled: goes_on() returned false.
  Status VisitVertices(const std::function<bool()>& goes_on, auto&& take) const {
    return Visit<SurfaceVertex>(begin_, vertices_, goes_on, take);
  }
  Status VisitTriangles(const std::function<bool()>& goes_on, auto&& take) const {
    return Visit<SurfaceTriangle>(begin_ + vertices_ * sizeof(SurfaceVertex), triangles_, goes_on, take);
  }
  Result<std::vector<std::int32_t>> LastSlice() const {
    return Read<std::int32_t>(EndOf() - last_slice_ * sizeof(std::int32_t), 0, last_slice_, last_slice_);
  }
  Status Damaged() const { return Status::DataLoss(fmt::format("'{}' is damaged: remove it and make this part again", path_)); }

 private:
  explicit Part(const std::string& path) : path_(path), file_(::open(path.c_str(), O_RDONLY | O_CLOEXEC)) {}

  // Some elements from `first` on of the `count` that begin at a byte.
  template <class T>
  Result<std::vector<T>> Read(std::uint64_t begin, std::uint64_t first, std::uint64_t count, std::uint64_t most = kReadAtOnce) const {
    std::vector<T> some(std::min(most, count - first));
    const auto bytes = std::as_writable_bytes(std::span(some));
    if (ReadBytesAt(file_.number(), begin + first * sizeof(T), bytes) != bytes.size()) return Damaged();
    return some;
  }

  template <class T>
  Status Visit(std::uint64_t begin, std::uint64_t count, const std::function<bool()>& goes_on, auto&& take) const {
    for (std::uint64_t done = 0; done < count;) {
      if (!goes_on()) return Status::Cancelled("was stopped");
      Result<std::vector<T>> some = Read<T>(begin, done, count);
      if (!some.ok()) return some.status();
      done += some->size();
      if (Status status = take(*std::move(some)); !status.ok()) return status;
    }
    return Status::Ok();
  }

  std::uint64_t EndOf() const {
    return begin_ + vertices_ * sizeof(SurfaceVertex) + triangles_ * sizeof(SurfaceTriangle) + last_slice_ * sizeof(std::int32_t);
  }

  static constexpr std::uint64_t kMostElements = std::uint64_t{8} * kMaxSurfaceVertices;  // so that no sum of bytes overflows

  std::string path_;
  FileDescriptor file_;
  std::uint64_t begin_ = 0, vertices_ = 0, triangles_ = 0, last_slice_ = 0;
};

// Adds a part whose first vertex has the number `first` in the mesh. `before`: numbers in the mesh of the last slice before it.
Status AddPart(const Part& part, std::int64_t first, const std::vector<std::int32_t>& before, MeshFile& file,
               const std::function<bool()>& goes_on) {
  const Status added = part.VisitVertices(goes_on, [&](std::vector<SurfaceVertex> vertices) {
    file.Add({std::move(vertices), {}});
    return Status::Ok();
  });
  if (!added.ok()) return added;
  return part.VisitTriangles(goes_on, [&](std::vector<SurfaceTriangle> triangles) {
    for (std::int32_t& corner : std::span(triangles.front().data(), 3 * triangles.size())) {
      const std::int64_t own = corner, others = own - kOthersVertex;
      if (own >= std::int64_t(part.vertices()) || (own < 0 && others >= std::int64_t(before.size()))) return part.Damaged();
      corner = own >= 0 ? std::int32_t(first + own) : before[std::size_t(others)];
    }
    file.Add({{}, std::move(triangles)});
    return Status::Ok();
  });
}

Status AddParts(const std::vector<Part>& parts, MeshFile& file, const std::function<bool()>& goes_on) {
  std::int64_t all = 0;
  for (const Part& part : parts) all += std::int64_t(std::min<std::uint64_t>(part.vertices(), kMaxSurfaceVertices + std::uint64_t{1}));
  if (all > kMaxSurfaceVertices) return TooManyVertices();
  std::vector<std::int32_t> before;
  for (const Part& part : parts) {
    const std::int64_t first = file.vertices();
    if (Status status = AddPart(part, first, before, file, goes_on); !status.ok()) return status;
    Result<std::vector<std::int32_t>> last = part.LastSlice();
    if (!last.ok()) return last.status();
    for (std::int32_t& vertex : *last) {
      if (vertex < 0 || vertex >= std::int64_t(part.vertices())) return part.Damaged();
      vertex = std::int32_t(first + vertex);
    }
    before = *std::move(last);
  }
  return Status::Ok();
}

}  // namespace

std::string PathOfPart(const std::string& path, const SurfaceShare& share) {
  return fmt::format("{}.part{}of{}", path, share.part, share.parts);
}

bool HasPart(const std::string& path, const MeshOf& of, const SurfaceShare& share) {
  return Part::Open(PathOfPart(path, share), of, share).has_value();
}

Status FinishPart(MeshFile& file, const MeshOf& of, const SurfaceShare& share, std::span<const std::int32_t> last_slice,
                  const std::function<bool()>& goes_on) {
  const std::string numbers = fmt::format("{} {} {}\n", file.vertices(), file.triangles(), last_slice.size());
  return file.FinishRaw(TitleOf(of, share) + numbers, std::as_bytes(last_slice), goes_on);
}

Result<MeshCounts> JoinParts(const std::string& path, const MeshOf& of, const SurfaceShare& own, const std::function<bool()>& goes_on) {
  const std::string lock_path = path + ".joining";
  // Others may have seen all parts but this one, so it waits for them.
  const Result<FileDescriptor> lock = LockFile(lock_path, LockMode::kAlone);
  if (!lock.ok()) return lock.status();
  const auto remove = [](const std::string& file) { (void)std::remove(file.c_str()); };
  MeshCounts counts{.whole = false};
  std::vector<Part> found;
  for (int part = 1; part <= own.parts; ++part) {
    std::optional<Part> opened = Part::Open(PathOfPart(path, {part, own.parts}), of, {part, own.parts});
    if (!opened) counts.missing_parts.push_back(part);
    if (opened) found.push_back(*std::move(opened));
  }
  if (std::ranges::count(counts.missing_parts, own.part) > 0) counts.missing_parts.clear();
  if (found.size() < std::size_t(own.parts)) {
    remove(lock_path);
    return counts;
  }
  Result<MeshFile> file = MeshFile::Create(path);
  Status status = file.status();
  const auto tell = [&] {
    TouchLock(*lock);
    return goes_on();
  };
  if (status.ok()) status = AddParts(found, *file, tell);
  if (status.ok() && file->triangles() > 0) status = file->Finish(of, tell);
  if (status.ok()) {
    for (int part = 1; part <= own.parts; ++part) remove(PathOfPart(path, {part, own.parts}));
  }
  remove(lock_path);
  if (!status.ok()) return status;
  return MeshCounts{file->vertices(), file->triangles()};
}

}  // namespace slabstream
