// Messages of the voxels plane.
#pragma once

#include <algorithm>

#include "common/wire/value_fields.h"
#include "common/wire/voxel_messages.h"
#include "slabstream/v1/voxels.pb.h"

namespace slabstream {

// For the widest sample types and all layers, because only the dataset knows the actual ones.
inline std::uint32_t LastChunk(const Box& box) {
  const SampleTypes widest(ScalarType::kFloat32, {.labels = ScalarType::kUint16, .overlay = ScalarType::kFloat32});
  return std::max(ChunkCount(box, widest), 1U) - 1;
}

// Which chunk of which box.
void ChunkNameFields(auto& io, auto& m) {
  using P = decltype(ProtoOf(m));
  io.Any(m.dataset, &P::dataset, &P::set_dataset);
  io.Message("box", m.box, &P::box, &P::mutable_box);
  io.Any(m.chunk, &P::chunk, &P::set_chunk);
  io.Check([&](Checker& check) {
    const bool of_cells = IsCellChunk(m.chunk) && m.chunk - kFirstCellChunk < CellChunkCount(kMaxCellBytes);
    if (!of_cells) check.Range("chunk", m.chunk, 0, LastChunk(m.box));
  });
}

v1::ChunkRequest ProtoOf(const ChunkRequest&);
void Fields(auto& io, Is<ChunkRequest> auto& m) {
  using P = v1::ChunkRequest;
  io.Any(m.epoch, &P::epoch, &P::set_epoch);
  io.Any(m.worker, &P::worker, &P::set_worker);
  ChunkNameFields(io, m);
}

v1::Chunk ProtoOf(const Chunk&);
void Fields(auto& io, Is<Chunk> auto& m) {
  using P = v1::Chunk;
  io.Any(m.epoch, &P::epoch, &P::set_epoch);
  ChunkNameFields(io, m);
  io.OneOf("codec", m.codec, &P::codec, &P::set_codec, Codec::kRaw, Codec::kZstd);
  io.Range("raw_bytes", m.raw_bytes, &P::raw_bytes, &P::set_raw_bytes, 1, kChunkBytes);
  const std::uint32_t least = m.codec == Codec::kRaw ? m.raw_bytes : 1;
  io.Range("encoded_bytes", m.encoded_bytes, &P::encoded_bytes, &P::set_encoded_bytes, least, m.raw_bytes);
  io.Any(m.digest, &P::digest, &P::set_digest);
  io.Any(m.cell_bytes, &P::cell_bytes, &P::set_cell_bytes);
  io.Any(m.stored_bytes, &P::stored_bytes, &P::set_stored_bytes);
  io.Check([&](Checker& check) {
    if (!IsCellChunk(m.chunk)) {
      check.Range("cell_bytes", m.cell_bytes, 0, 0);
    } else {
      const std::uint64_t begin = BeginOfCellChunk(m.chunk);
      check.Range("cell_bytes", m.cell_bytes, begin + 1, kMaxCellBytes);
      if (check.ok())
        check.Range("raw_bytes", m.raw_bytes, BytesOfCellChunk(m.cell_bytes, m.chunk), BytesOfCellChunk(m.cell_bytes, m.chunk));
    }
  });
}

v1::ChunkRefused ProtoOf(const ChunkRefused&);
void Fields(auto& io, Is<ChunkRefused> auto& m) {
  using P = v1::ChunkRefused;
  io.Any(m.epoch, &P::epoch, &P::set_epoch);
  ChunkNameFields(io, m);
  io.Message("status", m.status, &P::status, &P::mutable_status);
}

}  // namespace slabstream
