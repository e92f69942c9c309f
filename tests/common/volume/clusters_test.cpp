#include "common/volume/clusters.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "common/volume/sphere.h"

namespace slabstream {
namespace {

using testing::HasSubstr;

std::uint8_t SampleAt(const Volume& volume, int x, int y, int z) {
  return volume.block.samples<std::uint8_t>()[volume.block.Offset({x, y, z})];
}

// The mean place of occupied voxels along x, in [0, 1].
double MiddleAlongX(const Volume& volume) {
  const int n = volume.description.geometry.size.x;
  double sum = 0, count = 0;
  for (int z = 0; z < n; ++z) {
    for (int y = 0; y < n; ++y) {
      for (int x = 0; x < n; ++x) {
        if (SampleAt(volume, x, y, z) == 0) continue;
        sum += double(x) / (n - 1);
        ++count;
      }
    }
  }
  return sum / count;
}

TEST(Clusters, HaveTheOccupancyThatWasAskedForWhereverTheyHaveDrifted) {
  for (const int size : {48, 75}) {
    for (const double occupancy : {0.01, 0.05, 0.2}) {
      for (const double time : {0.0, 0.4, 1.0}) {
        const Volume volume = MakeClusters({.size = size, .occupancy = occupancy, .time = time}).value();
        EXPECT_NEAR(MeasureOccupancy(volume), occupancy, 0.01 * occupancy) << size << " " << time;
      }
    }
  }
}

TEST(Clusters, OneBallIsABall) {
  const int n = 40;
  const Volume volume = MakeClusters({.size = n, .occupancy = 0.05, .balls = 1, .seed = 3, .time = 0.5}).value();
  // Half way, x is the middle whatever the seed; the other coordinates are where the longest columns are.
  std::vector<int> along_y(n), along_z(n);
  for (int k = 0; k < n; ++k) {
    for (int j = 0; j < n; ++j) {
      if (SampleAt(volume, n / 2, j, k) == 0) continue;
      ++along_y[std::size_t(j)];
      ++along_z[std::size_t(k)];
    }
  }
  const int y = int(std::ranges::max_element(along_y) - along_y.begin());
  const int z = int(std::ranges::max_element(along_z) - along_z.begin());
  double radius = 0;
  for (int x = 0; x < n; ++x) radius += SampleAt(volume, x, y, z) != 0 ? 0.5 : 0;
  for (int k = 0; k < n; ++k) {
    for (int j = 0; j < n; ++j) {
      for (int i = 0; i < n; ++i) {
        const double distance = std::sqrt(std::pow(i - (n - 1) / 2.0, 2) + std::pow(j - y, 2) + std::pow(k - z, 2));
        if (distance < radius - 2) {
          EXPECT_NE(SampleAt(volume, i, j, k), 0) << i << " " << j << " " << k;
        }
        if (distance > radius + 2) {
          EXPECT_EQ(SampleAt(volume, i, j, k), 0) << i << " " << j << " " << k;
        }
      }
    }
  }
}

TEST(Clusters, LieDenseNearACornerAndDriftToTheOtherEndOfX) {
  const ClusterRequest begin{.size = 64, .occupancy = 0.03};
  ClusterRequest end = begin;
  end.time = 1;
  EXPECT_LT(MiddleAlongX(MakeClusters(begin).value()), 0.4);
  EXPECT_GT(MiddleAlongX(MakeClusters(end).value()), 0.6);
}

TEST(Clusters, AreTheSameForTheSameSeedAlone) {
  const auto bytes = [](std::uint64_t seed) { return MakeClusters({.size = 32, .seed = seed}).value().block.bytes; };
  EXPECT_EQ(bytes(1), bytes(1));
  EXPECT_NE(bytes(1), bytes(2));
}

TEST(Clusters, RefuseWhatCannotBeMade) {
  const auto why = [](const ClusterRequest& request) { return MakeClusters(request).status().message(); };
  EXPECT_THAT(why({.size = 7}), HasSubstr("size of clusters is 7, must be in [8, 4096]"));
  EXPECT_THAT(why({.size = 32, .occupancy = 0.4}), HasSubstr("occupancy of clusters is 0.4, must be in [0.001, 0.3]"));
  EXPECT_THAT(why({.size = 32, .balls = 0}), HasSubstr("balls of clusters is 0"));
  EXPECT_THAT(why({.size = 32, .time = std::nan("")}), HasSubstr("time of clusters is nan"));
}

}  // namespace
}  // namespace slabstream
