// When pixels are packed on their way to another worker: where the link is slower than the codec.
//
// A byte of an image takes 1/link seconds as it is. Packed it takes 1/codec + ratio/link: packing, moving what is left of it, unpacking;
// the image is packed as a whole before it is moved, so the times add up. Codec and ratio depend on the picture: a sample of each image
// that might gain is packed and unpacked to know them. No link is slow to a worker of which nothing is known yet.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

#include "common/base/bytes.h"
#include "common/wire/image_messages.h"

namespace slabstream {

// A user's choice. kAuto: partial images where it pays. kOn: all partial images between processes, and the pictures for clients. kOff:
// nothing.
enum class Compression : std::uint8_t { kAuto, kOn, kOff };

// "auto", "on" or "off"; none for any other text.
std::optional<Compression> ParseCompression(std::string_view text);

struct CodecSpeed {
  double bytes_per_second = 0;  // packed and unpacked one after the other, of bytes as they are
  double ratio = 1;             // packed bytes / bytes as they are, [0, 1]
};

// `link_bytes_per_second` ≥ 0; 0: however slow it is; infinity: nothing gains.
bool PackingPays(double link_bytes_per_second, const CodecSpeed& codec);

// Packs and unpacks a part from the middle of `payload`, the runs of some image.
CodecSpeed SampleCodec(std::span<const std::byte> payload);

// False: the link is too fast for any payload to be packed.
bool MayPack(double link_bytes_per_second);

// `payload`, packed if that pays (`packed` says how), otherwise as it is. Takes processor time only where the link may be slow enough.
Bytes PackForLink(Bytes payload, double link_bytes_per_second, std::optional<PackedRuns>& packed);

}  // namespace slabstream
