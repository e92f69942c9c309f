#include "worker/renderers/zbuffer/surface.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <bit>
#include <memory>

#include "common/base/check.h"
#include "worker/kernels/draw_faces.h"
#include "worker/renderers/zbuffer/vertex_normals.h"

namespace slabstream {
namespace {

static_assert(kBrick == kFaceBrick);
static_assert(kMaxBins <= 1 << kBinBits);

// One brick's part of a Surface. Faces are numbered from 0.
struct BrickFaces {
  SurfaceBrick brick;
  std::vector<FaceSite> sites;
  std::vector<FaceNormals> normals;
};

template <class T>
class BrickSurface {
 public:
  BrickSurface(const VoxelBlock& voxels, const BinLookup<T>& lookup, const Vec3& spacing)
      : voxels_(voxels), lookup_(lookup), spacing_(spacing) {}

  // Faces of the voxels of `box`, which lies in the brick at `origin`.
  BrickFaces Find(const Index3& origin, const Box& box) {
    origin_ = origin;
    faces_ = {};
    faces_.brick = {origin, {box.end, box.begin}, {}};
    FindOpaque(box);
    FindOpen(box);
    if (std::ranges::any_of(open_, [](std::uint32_t row) { return row != 0; })) gradients_.Compute(voxels_, spacing_, origin);
    normals_.fill(kUnknown);
    // In the order of FaceIndex.
    for (int side = 0; side < kSides; ++side) {
      for (int parities = 0; parities < 8; ++parities) {
        for (std::int32_t z = parities >> 2; z < kFaceBrick; z += 2) {
          for (std::int32_t y = parities >> 1 & 1; y < kFaceBrick; y += 2) {
            const std::uint32_t every_other = 0x5555U << (parities & 1);
            for (std::uint32_t rest = Open(side, y, z) & every_other; rest != 0; rest &= rest - 1) {
              AddFace({std::countr_zero(rest), y, z}, side);
            }
          }
        }
      }
      faces_.brick.side_begin[std::size_t(side) + 1] = std::uint32_t(faces_.sites.size());
    }
    return std::move(faces_);
  }

 private:
  static constexpr int kVertices = kFaceBrick + 1;
  static constexpr std::uint32_t kUnknown = 0xFFFFFFFF;  // not a valid packed normal: these leave the upper two bits free

  // Bit x + 1: voxel x of the row is opaque. Rows -1 ... kFaceBrick along y and z.
  std::uint32_t& Row(std::int32_t y, std::int32_t z) { return opaque_[std::size_t((z + 1) * (kFaceBrick + 2) + y + 1)]; }

  void FindOpaque(const Box& box) {
    opaque_.fill(0);
    const Box around = Grown(box, 1, voxels_.box);
    for (std::int32_t z = around.begin.z; z < around.end.z; ++z) {
      for (std::int32_t y = around.begin.y; y < around.end.y; ++y) {
        const T* sample = voxels_.samples<T>() + voxels_.Offset({around.begin.x, y, z});
        std::uint32_t row = 0;
        for (std::int32_t x = around.begin.x; x < around.end.x; ++x, ++sample) {
          row |= std::uint32_t(lookup_(*sample) != kNotSelected) << (x - origin_.x + 1);
        }
        Row(y - origin_.y, z - origin_.z) = row;
      }
    }
  }

  // Bit x: the side of voxel x of the row is open.
  std::uint32_t& Open(int side, std::int32_t y, std::int32_t z) { return open_[std::size_t((side * kFaceBrick + z) * kFaceBrick + y)]; }

  void FindOpen(const Box& box) {
    open_.fill(0);
    const std::uint32_t in_box = ((1U << (box.end.x - origin_.x)) - 1) & ~((1U << (box.begin.x - origin_.x)) - 1);
    for (std::int32_t z = box.begin.z - origin_.z; z < box.end.z - origin_.z; ++z) {
      for (std::int32_t y = box.begin.y - origin_.y; y < box.end.y - origin_.y; ++y) {
        const std::uint32_t row = Row(y, z), own = row >> 1 & in_box;
        const std::array<std::uint32_t, kSides> beyond = {
            row, row >> 2, Row(y - 1, z) >> 1, Row(y + 1, z) >> 1, Row(y, z - 1) >> 1, Row(y, z + 1) >> 1};
        for (int side = 0; side < kSides; ++side) Open(side, y, z) = own & ~beyond[std::size_t(side)];
      }
    }
  }

  void AddFace(const Index3& local, int side) {
    const Index3 voxel = {origin_.x + local.x, origin_.y + local.y, origin_.z + local.z};
    const T sample = voxels_.samples<T>()[voxels_.Offset(voxel)];
    faces_.sites.push_back(
        {std::uint16_t(voxel.x), std::uint16_t(voxel.y), std::uint16_t(voxel.z), std::uint16_t(lookup_(sample) | side << kBinBits)});
    const int axis = side / 2, u = axis == 0 ? 1 : 0, v = axis == 2 ? 1 : 2;
    FaceNormals corners;
    for (int corner = 0; corner < 4; ++corner) {
      Index3 vertex = local;  // at local - 1/2
      vertex[axis] += side % 2;
      vertex[u] += corner % 2;
      vertex[v] += corner / 2;
      corners[std::size_t(corner)] = NormalAt(vertex);
    }
    faces_.normals.push_back(corners);
    Box& bounds = faces_.brick.voxels;
    for (int i = 0; i < 3; ++i) {
      bounds.begin[i] = std::min(bounds.begin[i], voxel[i]);
      bounds.end[i] = std::max(bounds.end[i], voxel[i] + 1);
    }
  }

  std::uint32_t NormalAt(const Index3& vertex) {
    std::uint32_t& normal = normals_[std::size_t((vertex.z * kVertices + vertex.y) * kVertices + vertex.x)];
    if (normal == kUnknown) normal = PackNormal(gradients_.Gradient(vertex));
    return normal;
  }

  const VoxelBlock& voxels_;
  const BinLookup<T>& lookup_;
  const Vec3 spacing_;
  Index3 origin_;
  BrickFaces faces_;
  VertexNormals gradients_;
  std::array<std::uint32_t, std::size_t{kFaceBrick + 2} * (kFaceBrick + 2)> opaque_{};
  std::array<std::uint32_t, std::size_t{kVertices} * kVertices * kVertices> normals_{};
  std::array<std::uint32_t, std::size_t{kSides} * kFaceBrick * kFaceBrick> open_{};
};

Surface Join(std::vector<BrickFaces> parts) {
  Surface surface;
  std::size_t faces = 0;
  for (BrickFaces& part : parts) {
    for (std::uint32_t& begin : part.brick.side_begin) begin += std::uint32_t(faces);
    faces += part.sites.size();
    if (!part.sites.empty()) surface.bricks.push_back(part.brick);
  }
  CHECK_LT(faces, std::size_t{1} << 29) << "faces of one box: kernels address their normals by 32 bits";
  surface.sites.resize(faces + kSitesReadAhead);
  surface.normals.resize(faces);
  tbb::parallel_for(std::size_t{0}, parts.size(), [&](std::size_t i) {
    const BrickFaces& part = parts[i];
    std::ranges::copy(part.sites, surface.sites.begin() + std::ptrdiff_t(part.brick.side_begin[0]));
    std::ranges::copy(part.normals, surface.normals.begin() + std::ptrdiff_t(part.brick.side_begin[0]));
  });
  return surface;
}

}  // namespace

std::size_t Surface::bytes() const {
  return bricks.capacity() * sizeof(SurfaceBrick) + sites.capacity() * sizeof(FaceSite) + normals.capacity() * sizeof(FaceNormals);
}

Surface FindSurface(const VoxelBlock& voxels, const BrickRanges& ranges, const ClassificationTable& table, const BinSelection& opaque,
                    const Vec3& spacing, const Box& box) {
  const Box inside = Intersection(box, voxels.box);
  if (inside.empty()) return {};
  const BrickGrid bricks(inside);
  std::vector<BrickFaces> parts(bricks.size());
  VisitScalarType(voxels.type, [&]<class T>(const T*) {
    const BinLookup<T> lookup(table, opaque);
    ForEachRowOfBricks(bricks, [&](Index3 brick) {
      const auto surface = std::make_unique<BrickSurface<T>>(voxels, lookup, spacing);
      for (; brick.x < bricks.first.x + bricks.counts.x; ++brick.x) {
        const BrickRanges::Range& range = ranges.Of(brick);
        if (!lookup.AnyBetween(range.min, range.max)) continue;
        const Index3 origin = {brick.x * kFaceBrick, brick.y * kFaceBrick, brick.z * kFaceBrick};
        parts[bricks.Number(brick)] = surface->Find(origin, bricks.BoxOf(brick));
      }
    });
  });
  return Join(std::move(parts));
}

}  // namespace slabstream
