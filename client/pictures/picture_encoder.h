// PictureEncoder: rows of pixels to the bytes of a picture's file.
//
// PNG, JPEG and WebP are written by libraries that programs load anyway. The others are written by a module of its own,
// libslabstream-pictures.so: EXR and TIFF by OpenImageIO, PDF and SVG by cairo. It is loaded when it is needed: OpenImageIO brings 200
// other libraries, and loading them takes 0.2 s of processor time.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>

#include "client/pictures/mark.h"

namespace slabstream {

inline constexpr double kMetresAnInch = 0.0254;

enum class PictureFileType { kPng, kJpeg, kWebp, kTiff, kExr, kPdf, kSvg };

struct EncodedFormat {
  PictureFileType type = PictureFileType::kPng;
  int width = 0, height = 0;
  int bits = 8;                               // bits of the samples of PNG and TIFF: 8 or 16. EXR has floats, the others have 8 bits
  bool with_depth = false;                    // an EXR has depths: Z follows R, G, B and A
  int quality = 90;                           // the quality of JPEG and WebP, [1, 100]
  bool quickly = false;                       // JPEG: colours have half the resolution whatever the quality
  std::optional<double> density;              // pixels a metre
  std::string software, record_name, record;  // texts for the file's header; an empty record: none of them
  // What PDF and SVG show over the pixels; in other formats the pixels hold it, and so they hold what lies below the picture.
  std::span<const Mark> marks = {};
  std::string font;  // the file of the letters; only with marks
};

// Takes bytes of the file, in any order. False: it cannot, and is not called again.
using WriteBytes = std::function<bool(std::int64_t offset, std::span<const std::byte> bytes)>;
// Takes row y. False: the encoder has failed. Samples of a pixel: R, G, B, A with straight alpha, of EncodedFormat::bits; JPEG: R, G, B
// and one that does not count, of 8 bits; EXR: premultiplied floats R, G, B, A and perhaps Z.
using WriteRow = std::function<bool(int y, const void* row)>;
// Passes on the rows [begin, end) in their order and returns false as soon as one fails, or if it gives up. Any thread.
using PictureRows = std::function<bool(int begin, int end, const WriteRow&)>;

// nullopt: done; else the reason. std::bad_alloc: there is no memory left. Any thread.
using PictureEncoder = std::optional<std::string> (*)(const EncodedFormat& format, const PictureRows& rows, const WriteBytes& write);

// Of PNG, JPEG and WebP; of the other types null.
PictureEncoder OwnPictureEncoder(PictureFileType type);

// What the module exports, as kPictureEncoderEntry, for the other types; and the encoders that it has.
using PictureEncoderEntry = PictureEncoder (*)(PictureFileType type);
inline constexpr char kPictureEncoderEntry[] = "SlabstreamPictureEncoder";
std::optional<std::string> EncodeByOiio(const EncodedFormat& format, const PictureRows& rows, const WriteBytes& write);   // EXR, TIFF
std::optional<std::string> EncodeByCairo(const EncodedFormat& format, const PictureRows& rows, const WriteBytes& write);  // PDF, SVG

inline constexpr char kBytesNotTaken[] = "the bytes were not taken";  // a reason

}  // namespace slabstream
