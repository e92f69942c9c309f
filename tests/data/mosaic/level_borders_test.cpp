// What an adaptive mesh shows on the two sides of a border between levels, over random refinements: zones of a level's map, whose voxels
// the mosaic reads.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <memory>
#include <numbers>
#include <span>
#include <vector>

#include "common/planning/levels.h"
#include "common/volume/indices.h"
#include "data/mosaic/adaptive_mesh.h"
#include "tests/data/sources/memory_source.h"
#include "tests/support/random.h"

namespace slabstream {
namespace {

constexpr std::int32_t kSide = 256, kPatch = 8;  // cells of the finest level, and of a patch of any level
constexpr int kLevels = 3;

using Field = std::function<double(const Vec3& place)>;  // places: in cells of the finest level, from the domain's corner

class LevelBorders {
 public:
  explicit LevelBorders(Random& random) : random_(random) {
    // A patch of a level lies among patches of the next coarser one, as simulations refine.
    refined_[0] = {{{0, 0, 0}, Uniform(kSide >> (kLevels - 1))}};
    const Vec3 middle = {random.Real(0.3, 0.7), random.Real(0.3, 0.7), random.Real(0.3, 0.7)};
    for (std::size_t level = 1; level < kLevels; ++level) {
      const Index3 patches = Uniform((kSide >> (kLevels - 1 - level)) / kPatch);
      for (const Index3& patch : IndicesIn(patches)) {
        const Box box = {kPatch * patch, kPatch * (patch + Uniform(1))};
        const Vec3 from = (double(kPatch) / kSide * (1 << (kLevels - 1 - level))) * ToVec3(patch) - middle;
        if (Dot(from, from) > 0.15 / double(level * level) || !random.Chance(level == 1 ? 0.95 : 0.3)) continue;
        const Box beneath = Grown({box.begin / Uniform(2), box.end / Uniform(2)}, 1, {{0, 0, 0}, kPatch * patches / Uniform(2)});
        if (level == 1 || Covered(level - 1, beneath)) refined_.at(level).push_back(box);
      }
    }
  }

  // Calls border(jump, bends along, bends) at points on borders, many of them beside an edge of a zone: by how much the values on the two
  // sides differ, and the greatest second differences of the coarser voxels beside the point, added up over the axes along the border, and
  // over all of them.
  template <class Border>
  void Visit(const Field& field, Border&& border) {
    const std::shared_ptr<VolumeSource> source = Source(field);
    std::vector<std::vector<float>> voxels;
    VolumeLevels levels;
    for (int level = 0; level < kLevels; ++level) {
      const SourceLevel& of = source->info().levels.at(std::size_t(level));
      levels.levels.push_back(of.description);
      levels.refined.push_back(of.refined);
      std::vector<float>& read = voxels.emplace_back(std::size_t(of.description.geometry.bounds().voxel_count()));
      ASSERT_TRUE(source->ReadNow(level, of.description.geometry.bounds(), std::as_writable_bytes(std::span(read))).ok());
    }
    const LevelMap map = MapOf(levels);
    const auto value = [&](int level, const Index3& v) {
      return double(voxels.at(std::size_t(level)).at(NumberIn(Uniform(kSide >> level), v)));
    };
    const auto sample = [&](int level, const Vec3& place) {
      double sum = 0;
      for (int corner = 0; corner < 8; ++corner) {
        Index3 v;
        double weight = 1;
        for (const Axis axis : kAxes) {
          const double at = place[axis] / (1 << level) - 0.5, low = std::floor(at);
          const bool upper = (corner >> Number(axis) & 1) != 0;
          v[axis] = std::int32_t(low) + (upper ? 1 : 0);
          weight *= upper ? at - low : 1 - (at - low);
        }
        sum += weight * value(level, v);
      }
      return sum;
    };
    for (const Index3& zone : IndicesIn(map.counts)) {
      for (const Axis axis : kAxes) {
        Index3 next = zone;
        if (++next[axis] == map.counts[axis] || map.Of(next) == map.Of(zone)) continue;
        const int finer = std::min(map.Of(zone), map.Of(next)), coarser = std::max(map.Of(zone), map.Of(next));
        for (int i = 0; i < 40; ++i) {
          // Two cells of any level away from a corner of the zone, so the bends there are of voxels of the domain. In one of two cases
          // beside one of the zone's edges.
          constexpr double kMargin = 2 << (kLevels - 1);
          Vec3 place;
          for (const Axis a : kAxes) {
            const double begin = double(zone[a]) * map.side[a], end = begin + map.side[a];
            place[a] = a == axis ? end : random_.Real(begin + kMargin, end - kMargin);
          }
          const Axis beside = kAxes.at(std::size_t(random_.Integer(0, 2)));
          if (beside != axis && zone[beside] > 0 && random_.Chance(0.75)) {
            place[beside] = double(zone[beside]) * map.side[beside] + random_.Real(0, 0.5);
          }
          double along = 0, all = 0;
          for (const Axis a : kAxes) {
            double bend = 0;
            const Index3 floor = ToIndex(place, coarser);
            for (const Index3& v : IndicesIn({floor, floor + Uniform(2)})) {
              Index3 before = v, after = v;
              --before[a];
              ++after[a];
              bend = std::max(bend, std::abs(value(coarser, before) - 2 * value(coarser, v) + value(coarser, after)));
            }
            all += bend;
            if (a != axis) along += bend;
          }
          border(std::abs(sample(finer, place) - sample(coarser, place)), along, all);
        }
      }
    }
  }

 private:
  bool Covered(std::size_t level, const Box& box) const {
    std::int64_t inside = 0;
    for (const Box& patch : refined_.at(level)) inside += Intersection(patch, box).voxel_count();
    return inside == box.voxel_count();
  }

  static Index3 ToIndex(const Vec3& place, int level) {
    Index3 index;
    for (const Axis axis : kAxes) index[axis] = std::int32_t(std::floor(place[axis] / (1 << level) - 0.5));
    return index;
  }

  // A cell's value is the field's at its centre.
  std::shared_ptr<VolumeSource> Source(const Field& field) const {
    SourceInfo info;
    info.exact = {SampleType::kFloat32, {}};
    std::vector<MeshLevel> mesh(kLevels);
    for (std::size_t level = 0; level < kLevels; ++level) {
      const double cell = 1 << (kLevels - 1 - level);
      mesh[level].spacing = cell * Vec3{1, 1, 1};
      for (const Box& box : refined_.at(level)) {
        const auto open = [box, cell, &field]() -> Result<std::shared_ptr<VolumeSource>> {
          auto volume = std::make_shared<Volume>();
          volume->description = {{box.size()}, ScalarType::kFloat32, {}};
          volume->block = MakeVoxelBlock({{0, 0, 0}, box.size()}, ScalarType::kFloat32);
          std::size_t number = 0;
          for (const Index3& v : IndicesIn(box)) {
            volume->block.samples<float>()[number++] = float(field(cell * (ToVec3(v) + Vec3{0.5, 0.5, 0.5})));
          }
          return MakeMemorySource(std::move(volume), {});
        };
        mesh[level].parts.push_back({"patch", box, open});
      }
    }
    return MakeAdaptiveMesh("mesh", info, {}, std::move(mesh)).value();
  }

  static LevelMap MapOf(VolumeLevels& levels) {
    VolumeSummary summary{.description = levels.levels.back(), .range = {0, 1}};
    summary.histogram.fill(1);
    summary.brick_counts = CubesOver(summary.description.geometry.size, kBrick);
    summary.bricks.assign(CountIn(summary.brick_counts), {0, 1});
    levels.overview = std::make_shared<const VolumeSummary>(summary);
    FrameRequest request;
    request.dataset = "mesh";
    request.renderer = "raycast";
    request.transfer.choice = TransferFunction{.colors = {{0, {1, 1, 1}}}, .opacities = {{0, 0.5}}};
    request.detail = 0.01;
    return LevelsOf(request, levels).value();
  }

  Random& random_;
  std::array<std::vector<Box>, kLevels> refined_;  // coarsest first, in cells of the level
};

// A wave in a random direction of so many cells of the finest level, with values in [0, 1].
Field Wave(Random& random, double cells) {
  Vec3 way = {random.Real(-1, 1), random.Real(-1, 1), random.Real(-1, 1)};
  way = (2 * std::numbers::pi / cells / std::sqrt(Dot(way, way))) * way;
  return [way, phase = random.Real(0, 6)](const Vec3& place) { return 0.5 + 0.5 * std::sin(Dot(way, place) + phase); };
}

TEST(LevelBordersTest, ALinearFieldHasNoJump) {
  Random random(64);
  SCOPED_TRACE(random.trace());
  for (int round = 0; round < 3; ++round) {
    int met = 0;
    LevelBorders(random).Visit([](const Vec3& p) { return (p.x - 3 * p.y + 0.25 * p.z) / kSide; },
                               [&](double jump, double, double) {
                                 ++met;
                                 ASSERT_LE(jump, 2e-6);
                               });
    EXPECT_GT(met, 1000);
  }
}

// Zones reach a cell beyond the faces of what is refined, so at their borders fine voxels are interpolated between coarse ones. The two
// sides differ where a line between fine voxels cuts the bend of the coarse ones, by an eighth of the second difference along each axis of
// the border. Beside an edge, a refined cell counts a quarter. It differs from what the coarse cells tell by 3/32 of the second difference
// along each axis. For waves of L coarse cells an eighth of the bends is at most (2 pi / L)^2 / 16 of the range: 1e-3 if L is 50.
TEST(LevelBordersTest, AJumpIsAnEighthOfTheBendsAlongTheBorder) {
  Random random(65);
  SCOPED_TRACE(random.trace());
  for (const double cells : {16.0, 50.0 * 4, 1000.0}) {
    int met = 0;
    double greatest = 0;
    LevelBorders(random).Visit(Wave(random, cells), [&](double jump, double along, double all) {
      ++met;
      greatest = std::max(greatest, jump);
      ASSERT_LE(jump, along / 8 + all * 3 / 128 + 2e-6) << cells;
    });
    EXPECT_GT(met, 1000);
    if (cells >= 200) {
      EXPECT_LE(greatest, 1e-3) << cells;
    }
  }
}

}  // namespace
}  // namespace slabstream
