// A compressed DICOM frame, as slabstream-dicom-decoder is told of it: by text, since that program is another process. It answers each
// frame by the size of what the codec printed (uint32 in this machine's byte order, at most kMostCodecText), that text, and the pixels.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <iomanip>
#include <istream>
#include <optional>
#include <ostream>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace slabstream {

inline constexpr const char* kDicomDecoderProgram = "slabstream-dicom-decoder";
inline constexpr std::uint32_t kMostCodecText = 4096;  // bytes for a frame; what a codec prints beyond is lost

enum class DicomCodec { kJpeg, kJpegLs, kJpeg2000, kRle };

// The codec of a transfer syntax (UID), if its frames can be decompressed.
inline std::optional<DicomCodec> FindDicomCodec(std::string_view transfer_syntax) {
  constexpr std::array<std::pair<std::string_view, DicomCodec>, 12> kCodecs = {{
      {"1.2.840.10008.1.2.4.50", DicomCodec::kJpeg},
      {"1.2.840.10008.1.2.4.51", DicomCodec::kJpeg},
      {"1.2.840.10008.1.2.4.57", DicomCodec::kJpeg},
      {"1.2.840.10008.1.2.4.70", DicomCodec::kJpeg},
      {"1.2.840.10008.1.2.4.80", DicomCodec::kJpegLs},
      {"1.2.840.10008.1.2.4.81", DicomCodec::kJpegLs},
      {"1.2.840.10008.1.2.4.90", DicomCodec::kJpeg2000},
      {"1.2.840.10008.1.2.4.91", DicomCodec::kJpeg2000},
      {"1.2.840.10008.1.2.4.201", DicomCodec::kJpeg2000},  // this one and the next two: high throughput
      {"1.2.840.10008.1.2.4.202", DicomCodec::kJpeg2000},
      {"1.2.840.10008.1.2.4.203", DicomCodec::kJpeg2000},
      {"1.2.840.10008.1.2.5", DicomCodec::kRle},
  }};
  const auto* const found = std::ranges::find(kCodecs, transfer_syntax, &std::pair<std::string_view, DicomCodec>::first);
  return found == kCodecs.end() ? std::nullopt : std::optional(found->second);
}

struct CompressedFrame {
  std::string path, transfer_syntax;
  std::vector<std::pair<std::int64_t, std::int64_t>> fragments;  // (offset, bytes) in the file, one after the other
  std::int32_t columns = 0, rows = 0;
  int bits_allocated = 0;

  std::int64_t bytes() const { return std::int64_t{columns} * rows * (bits_allocated / 8); }

  friend bool operator==(const CompressedFrame&, const CompressedFrame&) = default;
  friend std::ostream& operator<<(std::ostream& out, const CompressedFrame& frame) {
    out << std::quoted(frame.path) << ' ' << std::quoted(frame.transfer_syntax) << ' ' << frame.columns << ' ' << frame.rows << ' '
        << frame.bits_allocated << ' ' << frame.fragments.size();
    for (const auto& [offset, bytes] : frame.fragments) out << ' ' << offset << ' ' << bytes;
    return out << '\n';
  }
  friend std::istream& operator>>(std::istream& in, CompressedFrame& frame) {
    std::size_t fragments = 0;
    in >> std::quoted(frame.path) >> std::quoted(frame.transfer_syntax) >> frame.columns >> frame.rows >> frame.bits_allocated >> fragments;
    frame.fragments.resize(in ? fragments : 0);
    for (auto& [offset, bytes] : frame.fragments) in >> offset >> bytes;
    return in;
  }
};

}  // namespace slabstream
