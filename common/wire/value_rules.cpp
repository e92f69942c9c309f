#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>
#include <string>

#include "common/image/run_image.h"
#include "common/wire/limits.h"
#include "common/wire/rules.h"

namespace slabstream {
namespace {

// For the widest samples, because only the dataset knows the actual ones.
std::uint32_t LastChunk(const Box& box) { return std::max(ChunkCount(box, ScalarType::kUint64), 1U) - 1; }

void CheckChunkNumber(const Box& box, std::uint32_t chunk, Checker& check) {
  const bool of_cells = IsCellChunk(chunk) && chunk - kFirstCellChunk < CellChunkCount(kMaxCellBytes);
  if (!of_cells) check.Range("chunk", chunk, 0, LastChunk(box));
}

}  // namespace

void CheckPositive(std::string_view field, const Vec3& v, Checker& check) {
  const auto scope = check.In(field);
  check.Positive("x", v.x);
  check.Positive("y", v.y);
  check.Positive("z", v.z);
}

bool AreRightHanded(const Vec3& x, const Vec3& y, const Vec3& z) {
  constexpr double kTolerance = 1e-6;
  const auto near = [](double a, double b) { return std::abs(a - b) <= kTolerance; };
  return near(Length(x), 1) && near(Length(y), 1) && near(Dot(x, y), 0) && Length(Cross(x, y) - z) <= kTolerance;
}

void Rules(const Box& m, Checker& check) { check.That(!m.empty(), "", "an empty box"); }

void Rules(const PixelRange& m, Checker& check) { check.Range("end", m.end, m.begin, kMaxFramePixels); }

void Rules(const ValueRange& m, Checker& check) { check.That(m.min <= m.max, "", "min is above max"); }

void Rules(const Orientation& m, Checker& check) {
  check.That(AreRightHanded(m.axes[0], m.axes[1], m.axes[2]), "x_axis", "not of three right-handed unit vectors at right angles");
  check.That(!m.unit || *m.unit > LengthUnit::kFile, "unit", "none that a file states");
}

void Rules(const VolumeDescription& m, Checker& check) {
  CheckPositive("spacing", m.geometry.spacing, check);
  const auto scope = check.In("size");
  check.Range("x", std::uint32_t(m.geometry.size.x), 1, kMaxVolumeSide);
  check.Range("y", std::uint32_t(m.geometry.size.y), 1, kMaxVolumeSide);
  check.Range("z", std::uint32_t(m.geometry.size.z), 1, kMaxVolumeSide);
}

// At most kMaxFramePixels pixels and 2^32 runs: the payload's length cannot overflow.
void Rules(const RunImageHeader& m, Checker& check) {
  const auto pixels = static_cast<std::uint64_t>(m.bounds.pixel_count());
  check.Range("pixel_count", m.pixel_count, 0, pixels);
  const bool may_have_no_runs = m.pixel_count == 0 || m.pixel_count == pixels;
  check.Range("run_count", m.run_count, may_have_no_runs ? 0 : 1, m.pixel_count);
  check.That(MayCode(m.format, m.color), "color", "that of another format");
  if (const std::uint64_t bytes = PayloadBytes(m); bytes > kMaxRunsBytes) {
    check.Fail("pixel_count", "a payload of " + std::to_string(bytes) + " bytes, at most " + std::to_string(kMaxRunsBytes));
  }
}

void Rules(const EncodedRuns& m, Checker& check) {
  const std::uint64_t raw_bytes = PayloadBytes(m.image);
  check.Range("encoded_bytes", m.encoded_bytes, m.codec == Codec::kRaw ? raw_bytes : 1, raw_bytes);
  const bool codes = m.image.format == PixelFormat::kRgba && m.image.color == ColorCoding::kStraight8;
  check.That(m.image.color == ColorCoding::kFloat32 || codes, "image.color", "of images between workers");
  check.That(!IsDense(m.image), "image.run_count", "0, of a picture with pixels");
}

// ---- the images plane

void Rules(const BlockName& m, Checker& check) {
  check.That(m.offset % kBlockAlignment == 0, "offset", std::to_string(m.offset) + " is no multiple of a page");
}

void Rules(const SharedImage& m, Checker& check) {
  check.That(!m.bounds.empty(), "bounds", "no pixels");
  check.Range("stride", m.stride, std::uint64_t(std::max(m.bounds.width(), 1)), kMaxFrameSide);
}

void Rules(const PackedRuns& m, Checker& check) { check.That(m.codec != Codec::kRaw, "codec", "raw, of packed runs"); }

void Rules(const PartialImage& m, Checker& check) {
  check.Range("interval_end", m.interval.end, std::uint64_t{m.interval.begin} + 1, kMaxRanks);
  check.That(m.image.format != PixelFormat::kRgbaDepth, "image.format", "that of a finished picture, which is not combined any more");
  check.That(m.image.color != ColorCoding::kStraight8 || HasVoxel(m.image.format), "image.color", "8 bits, of colours that blend");
  if (m.shared) {
    check.That(m.image.bounds.empty() && m.image.pixel_count == 0, "image", "runs beside a shared image");
    const std::size_t planes = HasDepth(m.image.format) ? 3 : 1;
    check.That(m.shared->planes.size() == planes, "shared.planes",
               std::to_string(m.shared->planes.size()) + " of " + std::to_string(planes));
    check.That(!m.packed, "packed", "beside a shared image");
  }
  if (m.packed) {
    const std::uint64_t raw = PayloadBytes(m.image);
    check.That(m.packed->bytes < raw, "packed.bytes",
               std::to_string(m.packed->bytes) + " are not less than the " + std::to_string(raw) + " of the runs");
  }
}

void Rules(const ShapeTiles& m, Checker& check) {
  check.That(!m.tiles.empty(), "tiles", "none");
  check.That(std::ranges::adjacent_find(m.tiles, std::ranges::greater_equal()) == m.tiles.end(), "tiles", "not ascending");
  check.That(m.bytes.size() == m.tiles.size(), "bytes",
             std::to_string(m.bytes.size()) + " of " + std::to_string(m.tiles.size()) + " tiles");
  const std::uint64_t raw = std::accumulate(m.bytes.begin(), m.bytes.end(), std::uint64_t{0});
  check.That(raw <= kMaxRunsBytes, "bytes", std::to_string(raw) + " in all, at most " + std::to_string(kMaxRunsBytes));
}

// ---- the voxels plane

void Rules(const ChunkRequest& m, Checker& check) { CheckChunkNumber(m.box, m.chunk, check); }
void Rules(const ChunkRefused& m, Checker& check) { CheckChunkNumber(m.box, m.chunk, check); }

void Rules(const Chunk& m, Checker& check) {
  CheckChunkNumber(m.box, m.chunk, check);
  check.Range("encoded_bytes", m.encoded_bytes, m.codec == Codec::kRaw ? m.raw_bytes : 1, m.raw_bytes);
  const bool of_cells = IsCellChunk(m.chunk);
  check.Range("cell_bytes", m.cell_bytes, of_cells ? BeginOfCellChunk(m.chunk) + 1 : 0, of_cells ? kMaxCellBytes : 0);
  if (!of_cells || !check.ok()) return;
  const std::uint32_t bytes = BytesOfCellChunk(m.cell_bytes, m.chunk);
  check.Range("raw_bytes", m.raw_bytes, bytes, bytes);
}

}  // namespace slabstream
