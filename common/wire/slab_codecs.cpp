#include "common/wire/codecs.h"

namespace slabstream {
namespace {

// Checks a chunk number for the widest sample type, because only the dataset knows the actual type.
std::uint32_t ReadChunkNumber(std::uint32_t chunk, const Box& box, Checker& check) {
  const std::uint32_t count = ChunkCount(box, ScalarType::kFloat32);
  return check.Range("chunk", chunk, 0, count == 0 ? 0 : count - 1);
}

}  // namespace

v1::ChunkRequest ToProto(const ChunkRequest& in) {
  v1::ChunkRequest out;
  out.set_epoch(in.epoch);
  out.set_worker(in.worker);
  out.set_dataset(in.dataset);
  *out.mutable_box() = ToProto(in.box);
  out.set_chunk(in.chunk);
  return out;
}

ChunkRequest FromProto(const v1::ChunkRequest& in, Checker& check) {
  ChunkRequest out;
  out.epoch = in.epoch();
  out.worker = in.worker();
  out.dataset = in.dataset();
  out.box = Read("box", in.box(), check);
  out.chunk = ReadChunkNumber(in.chunk(), out.box, check);
  return out;
}

v1::Chunk ToProto(const Chunk& in) {
  v1::Chunk out;
  out.set_epoch(in.epoch);
  out.set_dataset(in.dataset);
  *out.mutable_box() = ToProto(in.box);
  out.set_chunk(in.chunk);
  out.set_codec(WireEnum<v1::Codec>(in.codec, Codec::kRaw));
  out.set_raw_bytes(in.raw_bytes);
  out.set_encoded_bytes(in.encoded_bytes);
  out.set_digest(in.digest);
  return out;
}

Chunk FromProto(const v1::Chunk& in, Checker& check) {
  Chunk out;
  out.epoch = in.epoch();
  out.dataset = in.dataset();
  out.box = Read("box", in.box(), check);
  out.chunk = ReadChunkNumber(in.chunk(), out.box, check);
  out.codec = CodecFromProto(in.codec(), check);
  out.raw_bytes = check.Range("raw_bytes", in.raw_bytes(), 1, kChunkBytes);
  out.encoded_bytes = check.Range("encoded_bytes", in.encoded_bytes(), out.codec == Codec::kRaw ? out.raw_bytes : 1, out.raw_bytes);
  out.digest = in.digest();
  return out;
}

v1::ChunkRefused ToProto(const ChunkRefused& in) {
  v1::ChunkRefused out;
  out.set_epoch(in.epoch);
  out.set_dataset(in.dataset);
  *out.mutable_box() = ToProto(in.box);
  out.set_chunk(in.chunk);
  *out.mutable_status() = ToProto(in.status);
  return out;
}

ChunkRefused FromProto(const v1::ChunkRefused& in, Checker& check) {
  ChunkRefused out;
  out.epoch = in.epoch();
  out.dataset = in.dataset();
  out.box = Read("box", in.box(), check);
  out.chunk = ReadChunkNumber(in.chunk(), out.box, check);
  out.status = Read("status", in.status(), check);
  return out;
}

}  // namespace slabstream
