// Payload frames: how the runs of an image and the samples of a chunk are packed into bytes, and back.
//
// A packer fills the fields of the header that describe the payload; the unpacker checks the payload against them. Compression is zstd,
// level 1. If it does not make the payload smaller, or Codec::kRaw was asked for, the bytes are passed on unchanged, without a copy.
// Digests are XXH3-64 (seed 0). Unpacking takes memory only if the sizes in header and frame agree. All functions may be called from any
// thread.
#pragma once

#include <cstddef>
#include <optional>
#include <span>

#include "common/base/status.h"
#include "common/memory/bytes.h"
#include "common/wire/control_messages.h"
#include "common/wire/image_messages.h"
#include "common/wire/voxel_messages.h"

namespace slabstream {

// Packs the runs of an image (RunImage::payload; PayloadBytes(runs.image) bytes, runs.image is set already). Fills codec, encoded_bytes and
// digest of `runs`. kZstd groups the bytes of each 32-bit word by significance first: exponents and high bits of neighbouring pixels are
// alike.
Bytes PackRuns(Bytes payload, Codec codec, EncodedRuns& runs);

// Returns the runs' payload, PayloadBytes(runs.image) bytes. `runs` has come through Decode. DataLoss naming both values: the payload's
// length, its digest or its unpacked length is not what `runs` says, or zstd cannot read it. ReadRuns checks the runs themselves.
Result<Bytes> UnpackRuns(const EncodedRuns& runs, const Bytes& payload);

// The same between workers: packs `payload`, PayloadBytes of some image, with zstd. None: it does not get smaller.
std::optional<Bytes> PackRuns(std::span<const std::byte> payload, PackedRuns& packed);

// Takes `raw_bytes` of memory, PayloadBytes of the image: the caller has checked that the image fits its frame. DataLoss as above.
Result<Bytes> UnpackRuns(const PackedRuns& packed, const Bytes& payload, std::size_t raw_bytes);

// Packs the samples of one chunk, at most kChunkBytes bytes; none answers ChunkRequest::in_place. Fills codec, raw_bytes, encoded_bytes and
// digest of `chunk`.
Bytes PackChunk(Bytes samples, Codec codec, Chunk& chunk);

// Unpacks into `samples`, which has room for exactly chunk.raw_bytes. `chunk` has come through Decode. InvalidArgument: `samples` has
// another size; DataLoss: as UnpackRuns. After a failure the content of `samples` is undefined.
Status UnpackChunk(const Chunk& chunk, std::span<const std::byte> payload, std::span<std::byte> samples);

}  // namespace slabstream
