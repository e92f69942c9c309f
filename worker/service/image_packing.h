// When to pack pixels for another worker: if the link is slower than the codec.
//
// An unpacked byte takes 1/link seconds. Packed it takes 1/codec + ratio/link: packing, moving the packed bytes, unpacking. The image is
// packed as a whole before it is moved, so the times add up. Codec speed and ratio depend on the picture: they are measured on a sample of
// each image that might gain. A link to a worker about which nothing is known yet does not count as slow.
#pragma once

#include <optional>
#include <string_view>

#include "common/memory/bytes.h"
#include "common/wire/image_messages.h"
#include "worker/machine/worker_machine.h"

namespace slabstream {

// "auto", "on" or "off"; none for any other text.
std::optional<LinkCompression> ParseCompression(std::string_view text);

struct CodecSpeed {
  double bytes_per_second = 0;  // unpacked bytes a second, packed and unpacked one after the other
  double ratio = 1;             // packed bytes / unpacked bytes, [0, 1]
};

// `link_bytes_per_second` ≥ 0. 0: always pays; infinity: never pays.
bool PackingPays(double link_bytes_per_second, const CodecSpeed& codec);

// False: the link is too fast for any payload to be packed.
bool MayPack(double link_bytes_per_second);

// `payload`, packed if that pays (then `packed` says how). Takes processor time only if the link may be slow enough.
Bytes PackForLink(Bytes payload, double link_bytes_per_second, Rare<PackedRuns>& packed);

}  // namespace slabstream
