#include "worker/service/arriving_cells.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <numeric>

#include "common/mesh/mesh_part.h"
#include "common/wire/payload.h"
#include "tests/common/mesh/mesh_samples.h"

namespace slabstream {
namespace {

struct Sent {
  Chunk chunk;
  Bytes payload;
};

std::vector<Sent> ChunksOf(const std::vector<std::byte>& bytes) {
  std::vector<Sent> chunks;
  for (std::uint32_t i = 0; i < CellChunkCount(bytes.size()); ++i) {
    Chunk chunk{.epoch = 1, .dataset = 4, .box = {{0, 0, 0}, {10, 10, 10}}, .chunk = kFirstCellChunk + i, .cell_bytes = bytes.size()};
    const auto part = std::span(bytes).subspan(BeginOfCellChunk(chunk.chunk), BytesOfCellChunk(bytes.size(), chunk.chunk));
    Bytes payload = PackChunk(Bytes(std::vector<std::byte>(part.begin(), part.end())), Codec::kZstd, chunk);
    chunks.push_back({chunk, std::move(payload)});
  }
  return chunks;
}

TEST(ArrivingCells, AreThoseThatWereSentInWhateverOrder) {
  Random random(91);
  SCOPED_TRACE(random.trace());
  const Mesh mesh = MakeTetrahedralCube({40, 40, 40}, 32, random, 0.2, [](const Vec3& p) { return p.x; });
  std::vector<Sent> chunks = ChunksOf(EncodeMesh(mesh));
  ASSERT_GT(chunks.size(), 2U);
  std::swap(chunks.front(), chunks.back());
  ArrivingCells arriving;
  for (const Sent& sent : chunks) {
    EXPECT_EQ(arriving.cells(), nullptr);
    Chunk damaged = sent.chunk;
    damaged.digest ^= 1;
    EXPECT_EQ(arriving.Store(damaged, sent.payload.span()).code(), StatusCode::kDataLoss);
    for (int copy = 0; copy < 2; ++copy)
      EXPECT_TRUE(arriving.Store(sent.chunk, sent.payload.span()).ok()) << "a second copy changes nothing";
  }
  ASSERT_NE(arriving.cells(), nullptr);
  EXPECT_EQ(EncodeMesh(*arriving.cells()), EncodeMesh(mesh));
}

TEST(ArrivingCells, OtherBytesAreRefused) {
  ArrivingCells arriving;
  const std::vector<Sent> noise = ChunksOf(std::vector<std::byte>(100, std::byte{7}));
  EXPECT_EQ(arriving.Store(noise[0].chunk, noise[0].payload.span()).code(), StatusCode::kDataLoss);
  EXPECT_EQ(arriving.cells(), nullptr);
  Chunk huge = noise[0].chunk;
  huge.cell_bytes = kMaxCellBytes;
  EXPECT_EQ(arriving.Store(huge, noise[0].payload.span()).code(), StatusCode::kResourceExhausted);
}

}  // namespace
}  // namespace slabstream
