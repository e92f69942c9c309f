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
#include "common/view/picture_geometry.h"

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
    data_ = bytes_ > 0 ? ::mmap(nullptr, bytes_, PROT_READ, MAP_PRIVATE, file.number(), 0) : nullptr;
  }
  ~MappedFile() {
    if (ok() && bytes_ > 0) ::munmap(data_, bytes_);
  }
  MappedFile(const MappedFile&) = delete;
  MappedFile& operator=(const MappedFile&) = delete;

  bool ok() const { return data_ != MAP_FAILED; }
  std::span<const T> all() const { return {static_cast<const T*>(data_), bytes_ / sizeof(T)}; }
  // Lets go of the memory of pages that were read. Reading them again brings them back.
  void Forget() const {
    if (bytes_ > 0) ::madvise(data_, bytes_, MADV_DONTNEED);
  }

 private:
  const std::size_t bytes_;
  void* data_ = MAP_FAILED;
};

template <class T>
void Put(std::vector<std::byte>& bytes, const T& value) {
  const auto* const begin = reinterpret_cast<const std::byte*>(&value);
  bytes.insert(bytes.end(), begin, begin + sizeof value);
}

struct Joining {
  const MappedFile<SurfaceVertex> vertices;
  const MappedFile<SurfaceTriangle> triangles;
  const MeshOf& of;
  const std::function<bool()>& goes_on;
  OutputFile& out;

  // Appends what put(bytes, element) makes of each element of `from`, some at a time. Whether it went on to the end.
  template <class T, class Put>
  bool Append(const MappedFile<T>& from, Put&& put) {
    std::vector<std::byte> bytes;
    for (std::span<const T> rest = from.all(); !rest.empty() && out.ok();) {
      if (!goes_on()) return false;
      const std::size_t count = std::min(kAtOnce, rest.size());
      bytes.clear();
      for (const T& each : rest.first(count)) put(bytes, each);
      out.Append(bytes);
      rest = rest.subspan(count);
      vertices.Forget();
      triangles.Forget();
    }
    return true;
  }
};

bool WritePly(Joining& of) {
  of.out.Append(
      fmt::format("ply\nformat binary_little_endian 1.0\ncomment {}\ncomment {}\nelement vertex {}\nproperty float x\nproperty float y\n"
                  "property float z\nproperty float nx\nproperty float ny\nproperty float nz\nelement face {}\n"
                  "property list uchar int vertex_indices\nend_header\n",
                  of.of.surface, of.of.world, of.vertices.all().size(), of.triangles.all().size()));
  return of.Append(of.vertices, Put<SurfaceVertex>) &&
         of.Append(of.triangles, [](std::vector<std::byte>& bytes, const SurfaceTriangle& triangle) {
           Put(bytes, std::uint8_t{3});
           Put(bytes, triangle);
         });
}

bool WriteStl(Joining& of) {
  std::vector<std::byte> count;
  Put(count, std::uint32_t(of.triangles.all().size()));
  of.out.Append(fmt::format("{:<80.80}", "binary STL: " + of.of.surface));
  of.out.Append(count);
  return of.Append(of.triangles, [&](std::vector<std::byte>& bytes, const SurfaceTriangle& triangle) {
    std::array<Vec3, 3> corners;
    for (std::size_t i = 0; i < 3; ++i) {
      const std::array<float, 3>& position = of.vertices.all()[std::size_t(triangle[i])].position;
      corners[i] = {position[0], position[1], position[2]};
    }
    const Vec3 normal = Cross(corners[1] - corners[0], corners[2] - corners[0]);
    for (const Vec3& each : {Length(normal) > 0 ? Normalized(normal) : Vec3(), corners[0], corners[1], corners[2]})
      Put(bytes, std::array<float, 3>{float(each.x), float(each.y), float(each.z)});
    Put(bytes, std::uint16_t{0});
  });
}

}  // namespace

std::string WorldText(const VolumeGeometry& volume) {
  const World world = volume.orientation.world;
  const std::string_view axes = world == World::kPatient ? "patient, RAS: x to the right, y to anterior, z to superior"
                                : world == World::kScene ? "axes of the file"
                                                         : "axes of the voxels";
  const LengthUnit unit = UnitOf(volume);
  return fmt::format("world: {}; unit: {}", axes, unit > LengthUnit::kFile ? NameOf(unit) : "not stated");
}

struct MeshFormat {
  std::string_view ending;
  std::int64_t most_triangles;
  bool (*write)(Joining& of);  // false: was told not to go on
};

namespace {

constexpr std::array<MeshFormat, 2> kFormats = {{{".ply", INT64_MAX, WritePly}, {".stl", UINT32_MAX, WriteStl}}};

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

template <class Write>
Status MeshFile::Join(const MeshOf& of, const std::function<bool()>& goes_on, Write&& write) {
  for (OutputFile* const file : {&vertex_file_, &triangle_file_}) {
    if (Status closed = file->Close(); !closed.ok()) return closed;
  }
  Result<OutputFile> out = OutputFile::Create(path_);
  if (!out.ok()) return out.status();
  Joining joining{{vertex_file_.written_path(), vertices_}, {triangle_file_.written_path(), triangles_}, of, goes_on, *out};
  if (!joining.vertices.ok() || !joining.triangles.ok())
    return Status::Unavailable(fmt::format("cannot write '{}': its parts cannot be read: {}", path_, std::strerror(errno)));
  if (!write(joining)) return Status::Cancelled("writing was stopped");
  return out->Finish();
}

Status MeshFile::Finish(const MeshOf& of, const std::function<bool()>& goes_on) {
  const MeshFormat& format = *FindMeshFormat(path_);
  if (triangles_ > format.most_triangles) {
    return Status::ResourceExhausted(
        fmt::format("'{}': the surface has {} triangles, a file {} at most {}", path_, triangles_, format.ending, format.most_triangles));
  }
  return Join(of, goes_on, format.write);
}

Status MeshFile::FinishRaw(const std::string& head, std::span<const std::byte> tail, const std::function<bool()>& goes_on) {
  return Join({}, goes_on, [&](Joining& joining) {
    joining.out.Append(head);
    const bool whole = joining.Append(joining.vertices, Put<SurfaceVertex>) && joining.Append(joining.triangles, Put<SurfaceTriangle>);
    joining.out.Append(tail);
    return whole;
  });
}

}  // namespace slabstream
