// PictureEncoder: rows of pixels to the bytes of a PNG or EXR file. The only one uses OpenImageIO. It lies in a module of its own,
// libslabstream-pictures.so, which is loaded when the first picture is encoded: OpenImageIO brings 200 other libraries, and a program that
// loads them when it starts takes 0.2 s of processor time for it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>

namespace slabstream {

struct EncodedFormat {
  bool png = true;  // else EXR
  int width = 0, height = 0;
  int bits = 8;                               // of a PNG's samples: 8 or 16. EXR has floats
  bool with_depth = false;                    // of an EXR: Z follows R, G, B and A
  std::optional<double> density;              // pixels a metre (PNG) or an inch (EXR)
  std::string software, record_name, record;  // texts for the file's header; an empty record: none of them
};

class PictureEncoder {
 public:
  // Takes bytes of the file, in any order. False: it cannot, and is not called again.
  using WriteBytes = std::function<bool(std::int64_t offset, std::span<const std::byte> bytes)>;
  // Takes row y, of samples in the file's own layout. False: the encoder has failed.
  using WriteRow = std::function<bool(int y, const void* row)>;

  // Calls `rows` once, which passes on all rows from 0 and returns false as soon as one fails. nullopt: done; else the reason.
  virtual std::optional<std::string> Encode(const EncodedFormat& format, const std::function<bool(const WriteRow&)>& rows,
                                            const WriteBytes& write) const = 0;

 protected:
  ~PictureEncoder() = default;
};

// What the module exports, as kPictureEncoderEntry.
using PictureEncoderEntry = const PictureEncoder* (*)();
inline constexpr char kPictureEncoderEntry[] = "SlabstreamPictureEncoder";

}  // namespace slabstream
