#include "data/isosurface/mesh_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/mman.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cerrno>
#include <cstddef>
#include <cstring>
#include <span>
#include <utility>
#include <vector>

#include "common/files/file_descriptor.h"

namespace slabstream {
namespace {

static_assert(std::endian::native == std::endian::little);  // files of ours and STL are

constexpr std::size_t kAtOnce = std::size_t{1} << 18;  // vertices or triangles

// A file as an array. It must not become shorter meanwhile.
template <class T>
class MappedFile {
 public:
  MappedFile(const std::string& path, std::int64_t count) : bytes_(std::size_t(count) * sizeof(T)) {
    const FileDescriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
    if (bytes_ > 0) data_ = ::mmap(nullptr, bytes_, PROT_READ, MAP_PRIVATE, file.number(), 0);
  }
  ~MappedFile() {
    if (ok()) ::munmap(data_, bytes_);
  }
  MappedFile(const MappedFile&) = delete;
  MappedFile& operator=(const MappedFile&) = delete;

  bool ok() const { return data_ != MAP_FAILED; }
  std::span<const T> all() const { return {static_cast<const T*>(data_), bytes_ / sizeof(T)}; }
  // Pages that were read are no longer this process's; they come back when they are read again.
  void Forget() const { ::madvise(data_, bytes_, MADV_DONTNEED); }

 private:
  const std::size_t bytes_;
  void* data_ = MAP_FAILED;
};

struct Surface {
  const MappedFile<SurfaceVertex>& vertices;
  const MappedFile<SurfaceTriangle>& triangles;
  std::string about, world;  // lines for people, without an end
};

template <class T>
void Put(std::vector<std::byte>& bytes, const T& value) {
  const auto* const begin = reinterpret_cast<const std::byte*>(&value);
  bytes.insert(bytes.end(), begin, begin + sizeof value);
}

// Appends what put(buffer, element) makes of each element, some at a time.
template <class T, class Put>
bool AppendAll(const MappedFile<T>& from, OutputFile& out, const std::function<bool()>& goes_on, const Surface& surface, Put&& put) {
  std::vector<std::byte> buffer;
  for (std::span<const T> rest = from.all(); !rest.empty() && out.ok();) {
    if (!goes_on()) return false;
    const std::size_t count = std::min(kAtOnce, rest.size());
    buffer.clear();
    for (const T& each : rest.first(count)) put(buffer, each);
    out.Append(buffer);
    rest = rest.subspan(count);
    surface.vertices.Forget();
    surface.triangles.Forget();
  }
  return true;
}

bool WritePly(const Surface& surface, OutputFile& out, const std::function<bool()>& goes_on) {
  out.Append(fmt::format("ply\nformat binary_little_endian 1.0\ncomment {}\ncomment {}\nelement vertex {}\n", surface.about, surface.world,
                         surface.vertices.all().size()));
  for (const char* const name : {"x", "y", "z", "nx", "ny", "nz"}) out.Append(fmt::format("property float {}\n", name));
  out.Append(fmt::format("element face {}\nproperty list uchar int vertex_indices\nend_header\n", surface.triangles.all().size()));
  return AppendAll(surface.vertices, out, goes_on, surface, Put<SurfaceVertex>) &&
         AppendAll(surface.triangles, out, goes_on, surface, [](std::vector<std::byte>& buffer, const SurfaceTriangle& triangle) {
           Put(buffer, std::uint8_t{3});
           Put(buffer, triangle);
         });
}

bool WriteStl(const Surface& surface, OutputFile& out, const std::function<bool()>& goes_on) {
  std::string header = "binary STL: " + surface.about;
  header.resize(80, ' ');
  out.Append(header);
  std::vector<std::byte> count;
  Put(count, std::uint32_t(surface.triangles.all().size()));
  out.Append(count);
  return AppendAll(surface.triangles, out, goes_on, surface, [&](std::vector<std::byte>& buffer, const SurfaceTriangle& triangle) {
    std::array<Vec3, 3> corners;
    for (std::size_t i = 0; i < 3; ++i) {
      const std::array<float, 3>& position = surface.vertices.all()[std::size_t(triangle[i])].position;
      corners[i] = {position[0], position[1], position[2]};
    }
    const Vec3 normal = Cross(corners[1] - corners[0], corners[2] - corners[0]);
    const Vec3 unit = Length(normal) > 0 ? Normalized(normal) : Vec3();
    for (const Vec3& each : {unit, corners[0], corners[1], corners[2]})
      Put(buffer, std::array<float, 3>{float(each.x), float(each.y), float(each.z)});
    Put(buffer, std::uint16_t{0});
  });
}

bool WriteObj(const Surface& surface, OutputFile& out, const std::function<bool()>& goes_on) {
  const auto put = [](std::vector<std::byte>& buffer, const std::string& text) {
    const auto bytes = std::as_bytes(std::span(text));
    buffer.insert(buffer.end(), bytes.begin(), bytes.end());
  };
  out.Append(fmt::format("# {}\n# {}\n", surface.about, surface.world));
  return AppendAll(surface.vertices, out, goes_on, surface,
                   [&](std::vector<std::byte>& buffer, const SurfaceVertex& vertex) {
                     const auto& [p, n] = vertex;
                     put(buffer, fmt::format(FMT_STRING("v {} {} {}\nvn {} {} {}\n"), p[0], p[1], p[2], n[0], n[1], n[2]));
                   }) &&
         AppendAll(surface.triangles, out, goes_on, surface, [&](std::vector<std::byte>& buffer, const SurfaceTriangle& triangle) {
           const std::int64_t a = std::int64_t{triangle[0]} + 1, b = std::int64_t{triangle[1]} + 1, c = std::int64_t{triangle[2]} + 1;
           put(buffer, fmt::format(FMT_STRING("f {0}//{0} {1}//{1} {2}//{2}\n"), a, b, c));
         });
}

std::string WorldText(const Orientation& world) {
  const std::string_view axes = world.world == World::kPatient ? "patient, RAS: x to the right, y to anterior, z to superior"
                                : world.world == World::kScene ? "axes of the file"
                                                               : "axes of the voxels";
  const std::string_view unit = world.unit                       ? NameOf(*world.unit)
                                : world.world == World::kPatient ? NameOf(LengthUnit::kMillimetre)
                                                                 : "not stated";
  return fmt::format("world: {}; unit: {}", axes, unit);
}

}  // namespace

struct MeshFormat {
  std::string_view ending;
  std::int64_t most_triangles;
  bool (*write)(const Surface& surface, OutputFile& out, const std::function<bool()>& goes_on);  // false: was told not to go on
};

namespace {

constexpr std::array<MeshFormat, 3> kFormats = {
    {{".ply", INT64_MAX, WritePly}, {".stl", UINT32_MAX, WriteStl}, {".obj", INT64_MAX, WriteObj}}};

}  // namespace

const MeshFormat* FindMeshFormat(std::string_view path) {
  const auto* const found = std::ranges::find_if(kFormats, [&](const MeshFormat& format) { return path.ends_with(format.ending); });
  return found == kFormats.end() ? nullptr : found;
}

std::string MeshEndings() {
  std::string endings;
  for (const MeshFormat& format : kFormats) endings.append(endings.empty() ? "" : ", ").append(format.ending);
  return endings;
}

MeshFile::MeshFile(std::string path, OutputFile vertex_file, OutputFile triangle_file)
    : path_(std::move(path)), vertex_file_(std::move(vertex_file)), triangle_file_(std::move(triangle_file)) {}

Result<MeshFile> MeshFile::Create(const std::string& path) {
  Result<OutputFile> vertex_file = OutputFile::Create(path + ".vertices"), triangle_file = OutputFile::Create(path + ".triangles");
  if (!vertex_file.ok()) return vertex_file.status();
  if (!triangle_file.ok()) return triangle_file.status();
  return MeshFile(path, *std::move(vertex_file), *std::move(triangle_file));
}

void MeshFile::Add(const SurfacePart& part) {
  vertex_file_.Append(std::as_bytes(std::span(part.vertices)));
  triangle_file_.Append(std::as_bytes(std::span(part.triangles)));
  vertices_ += std::int64_t(part.vertices.size());
  triangles_ += std::int64_t(part.triangles.size());
}

Status MeshFile::Finish(const std::string& surface, const Orientation& world, const std::function<bool()>& goes_on) {
  const MeshFormat& format = *FindMeshFormat(path_);
  if (triangles_ > format.most_triangles) {
    return Status::ResourceExhausted(
        fmt::format("'{}': the surface has {} triangles, a file {} at most {}", path_, triangles_, format.ending, format.most_triangles));
  }
  for (OutputFile* const file : {&vertex_file_, &triangle_file_}) {
    if (Status closed = file->Close(); !closed.ok()) return closed;
  }
  const MappedFile<SurfaceVertex> vertices(vertex_file_.written_path(), vertices_);
  const MappedFile<SurfaceTriangle> triangles(triangle_file_.written_path(), triangles_);
  Result<OutputFile> out = OutputFile::Create(path_);
  if (!out.ok()) return out.status();
  if (!vertices.ok() || !triangles.ok()) {
    return Status::Unavailable(fmt::format("cannot write '{}': its parts cannot be read: {}", path_, std::strerror(errno)));
  }
  if (!format.write({vertices, triangles, surface, WorldText(world)}, *out, goes_on)) return Status::Cancelled("writing was stopped");
  return out->Finish();
}

}  // namespace slabstream
