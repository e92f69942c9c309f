#include "worker/renderers/zbuffer/surface.h"

#include <algorithm>
#include <bit>
#include <memory>
#include <tuple>
#include <utility>

#include "common/base/check.h"
#include "common/parallel/parallel.h"
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
  std::vector<std::uint32_t> labels;
};

// The packed normals at the vertices of a brick, made where they are asked for.
class BrickNormals {
 public:
  void Clear() {
    computed_ = false;
    normals_.fill(kUnknown);
  }
  // `compute` calls VertexNormals::Compute for the brick.
  template <class Compute>
  std::uint32_t At(const Index3& vertex, Compute&& compute) {
    std::uint32_t& normal = normals_[std::size_t((vertex.z * kVertices + vertex.y) * kVertices + vertex.x)];
    if (normal != kUnknown) return normal;
    if (!computed_) compute(gradients_);
    computed_ = true;
    return normal = PackNormal(gradients_.Gradient(vertex));
  }

 private:
  static constexpr int kVertices = kFaceBrick + 1;
  static constexpr std::uint32_t kUnknown = 0xFFFFFFFF;  // not a valid packed normal: these leave the upper two bits free

  VertexNormals gradients_;
  bool computed_ = false;
  std::array<std::uint32_t, std::size_t{kVertices} * kVertices * kVertices> normals_{};
};

template <class T>
class BrickSurface {
 public:
  // `labels` may be null.
  BrickSurface(const VoxelBlock& voxels, const BinLookup<T>& lookup, const BoxLabels* labels, const Vec3& spacing)
      : voxels_(voxels), lookup_(lookup), labels_(labels), spacing_(spacing) {
    if (labels != nullptr) label_normals_ = std::make_unique<BrickNormals>();
  }

  // Faces of the voxels of `box`, which lies in the brick at `origin`.
  BrickFaces Find(const Index3& origin, const Box& box) {
    origin_ = origin;
    around_ = Grown(box, 2, voxels_.box);
    faces_ = {};
    faces_.brick = {origin, {box.end, box.begin}, {}};
    FindOpaque(box);
    if (labels_ != nullptr) ApplyLabels(box);
    FindOpen(box);
    normals_.Clear();
    if (labels_ != nullptr) label_normals_->Clear();
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

  void ApplyLabels(const Box& box) {
    const Box around = Grown(box, 1, voxels_.box);
    for (Index3 v = around.begin; v.z < around.end.z; ++v.z) {
      for (v.y = around.begin.y; v.y < around.end.y; ++v.y) {
        std::uint32_t& row = Row(v.y - origin_.y, v.z - origin_.z);
        for (v.x = around.begin.x; v.x < around.end.x; ++v.x) {
          const std::uint32_t bit = 1U << (v.x - origin_.x + 1);
          const LabelUse use = labels_->UseOf(v);
          if (use != LabelUse::kAsVolume) row = use == LabelUse::kOpaque ? row | bit : row & ~bit;
        }
      }
    }
  }

  // 1 in opaque voxels, 0 in others: of all voxels that normals of the brick's part depend on.
  VoxelBlock Indicator() const {
    VoxelBlock indicator = MakeVoxelBlock(around_, ScalarType::kUint8);
    auto* out = indicator.samples<std::uint8_t>();
    const T* const samples = voxels_.samples<T>();
    for (Index3 v = around_.begin; v.z < around_.end.z; ++v.z) {
      for (v.y = around_.begin.y; v.y < around_.end.y; ++v.y) {
        for (v.x = around_.begin.x; v.x < around_.end.x; ++v.x) {
          const LabelUse use = labels_->UseOf(v);
          *out++ = use == LabelUse::kAsVolume ? lookup_(samples[voxels_.Offset(v)]) != kNotSelected : use == LabelUse::kOpaque;
        }
      }
    }
    return indicator;
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
    const std::uint32_t label = labels_ != nullptr ? labels_->NumberOf(voxel) : 0;
    const bool of_label = labels_ != nullptr && labels_->uses[label] == LabelUse::kOpaque;
    const std::uint16_t bin = of_label ? 0 : lookup_(sample);  // colours of labels hide those of bins
    faces_.sites.push_back({std::uint16_t(voxel.x), std::uint16_t(voxel.y), std::uint16_t(voxel.z), std::uint16_t(bin | side << kBinBits)});
    if (labels_ != nullptr) faces_.labels.push_back(label);
    const int axis = side / 2, u = axis == 0 ? 1 : 0, v = axis == 2 ? 1 : 2;
    FaceNormals corners;
    for (int corner = 0; corner < 4; ++corner) {
      Index3 vertex = local;  // at local - 1/2
      vertex[axis] += side % 2;
      vertex[u] += corner % 2;
      vertex[v] += corner / 2;
      corners[std::size_t(corner)] = of_label ? LabelNormalAt(vertex) : NormalAt(vertex);
    }
    faces_.normals.push_back(corners);
    Box& bounds = faces_.brick.voxels;
    for (int i = 0; i < 3; ++i) {
      bounds.begin[i] = std::min(bounds.begin[i], voxel[i]);
      bounds.end[i] = std::max(bounds.end[i], voxel[i] + 1);
    }
  }

  std::uint32_t NormalAt(const Index3& vertex) {
    return normals_.At(vertex, [&](VertexNormals& gradients) { gradients.Compute(voxels_, spacing_, origin_); });
  }
  // Labels have no values that rise: of the border of what is opaque.
  std::uint32_t LabelNormalAt(const Index3& vertex) {
    return label_normals_->At(vertex, [&](VertexNormals& gradients) { gradients.Compute(Indicator(), spacing_, origin_); });
  }

  const VoxelBlock& voxels_;
  const BinLookup<T>& lookup_;
  const BoxLabels* const labels_;
  const Vec3 spacing_;
  Index3 origin_;
  Box around_;  // the brick's part and the voxels that its normals depend on
  BrickFaces faces_;
  BrickNormals normals_;
  std::unique_ptr<BrickNormals> label_normals_;  // with labels
  std::array<std::uint32_t, std::size_t{kFaceBrick + 2} * (kFaceBrick + 2)> opaque_{};
  std::array<std::uint32_t, std::size_t{kSides} * kFaceBrick * kFaceBrick> open_{};
};

// The order of bricks in a surface.
bool InOrder(const Index3& a, const Index3& b) { return std::tie(a.z, a.y, a.x) < std::tie(b.z, b.y, b.x); }

// One brick's faces where they lie: in BrickFaces or in a known surface.
struct FoundFaces {
  SurfaceBrick brick;  // numbers faces of the arrays
  const FaceSite* sites = nullptr;
  const FaceNormals* normals = nullptr;
  const std::uint32_t* labels = nullptr;
};

// The faces of `part` of the brick at `origin`. False: no known box holds just this part of it.
bool FindKnown(std::span<const KnownSurface> known, const Index3& origin, const Box& part, FoundFaces& faces) {
  const Box whole = {origin, origin + Uniform(kFaceBrick)};
  const auto same = std::ranges::find_if(known, [&](const KnownSurface& other) { return Intersection(other.box, whole) == part; });
  if (same == known.end()) return false;
  const std::vector<SurfaceBrick>& bricks = same->surface->bricks;
  const auto brick = std::ranges::lower_bound(bricks, origin, InOrder, &SurfaceBrick::origin);
  if (brick != bricks.end() && brick->origin == origin) {
    faces = {*brick, same->surface->sites.data(), same->surface->normals.data(), same->surface->labels.data()};
  }
  return true;
}

Surface Join(std::span<const FoundFaces> parts, bool labelled) {
  Surface surface;
  std::vector<std::uint32_t> begins(parts.size());
  std::size_t faces = 0;
  for (std::size_t i = 0; i < parts.size(); ++i) {
    begins[i] = std::uint32_t(faces);
    if (parts[i].brick.face_count() == 0) continue;
    SurfaceBrick& brick = surface.bricks.emplace_back(parts[i].brick);
    for (std::uint32_t& begin : brick.side_begin) begin += begins[i] - parts[i].brick.side_begin[0];
    faces += brick.face_count();
  }
  CHECK_LT(faces, std::size_t{1} << 29) << "faces of one box: kernels address their normals by 32 bits";
  surface.sites.resize(faces + kSitesReadAhead);
  surface.normals.resize(faces);
  if (labelled) surface.labels.resize(faces + 1);
  ParallelFor(0, parts.size(), [&](std::size_t i) {
    const auto& [brick, sites, normals, labels] = parts[i];
    if (brick.face_count() == 0) return;
    std::copy_n(sites + brick.side_begin[0], brick.face_count(), surface.sites.data() + begins[i]);
    std::copy_n(normals + brick.side_begin[0], brick.face_count(), surface.normals.data() + begins[i]);
    if (labelled) std::copy_n(labels + brick.side_begin[0], brick.face_count(), surface.labels.data() + begins[i]);
  });
  return surface;
}

}  // namespace

std::size_t Surface::bytes() const {
  return bricks.capacity() * sizeof(SurfaceBrick) + sites.capacity() * sizeof(FaceSite) + normals.capacity() * sizeof(FaceNormals) +
         labels.capacity() * sizeof(std::uint32_t);
}

Surface FindSurface(const VoxelBlock& voxels, const OpaqueVoxels& opaque, const Vec3& spacing, const Box& box,
                    std::span<const KnownSurface> known) {
  const Box inside = Intersection(box, voxels.box);
  if (inside.empty()) return {};
  const BrickGrid bricks(inside);
  std::vector<BrickFaces> made(bricks.size());
  std::vector<FoundFaces> parts(bricks.size());
  std::vector<std::uint8_t> may_be_opaque(bricks.size());
  VisitScalarType(voxels.type, [&]<class T>(const T*) {
    const BinLookup<T> lookup(opaque.table, opaque.bins);
    const auto any_opaque = [&](const Index3& brick) {
      const BrickRanges::Range& range = opaque.ranges.Of(brick);
      if (lookup.AnyBetween(range.min, range.max)) return true;
      if (opaque.labels == nullptr) return false;
      const BrickRanges::Range& numbers = opaque.labels->ranges.Of(brick);
      return opaque.labels->AnyOpaqueBetween(numbers.min, numbers.max);
    };
    ForEachRowOfBricks(bricks, [&](Index3 brick) {
      std::unique_ptr<BrickSurface<T>> surface;  // large: only where something is found anew
      for (; brick.x < bricks.first.x + bricks.counts.x; ++brick.x) {
        if (!any_opaque(brick)) continue;
        const Index3 origin = {brick.x * kFaceBrick, brick.y * kFaceBrick, brick.z * kFaceBrick};
        const std::size_t number = bricks.Number(brick);
        may_be_opaque[number] = 1;
        if (FindKnown(known, origin, bricks.BoxOf(brick), parts[number])) continue;
        if (surface == nullptr) surface = std::make_unique<BrickSurface<T>>(voxels, lookup, opaque.labels, spacing);
        made[number] = surface->Find(origin, bricks.BoxOf(brick));
        parts[number] = {made[number].brick, made[number].sites.data(), made[number].normals.data(), made[number].labels.data()};
      }
    });
  });
  Surface surface = Join(parts, opaque.labels != nullptr);
  for (std::size_t i = 0; i < bricks.size(); ++i) {
    if (may_be_opaque[i] != 0) surface.opaque_hull = Hull(surface.opaque_hull, bricks.BoxOf(bricks.first + PlaceIn(bricks.counts, i)));
  }
  return surface;
}

}  // namespace slabstream
