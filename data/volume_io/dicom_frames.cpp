#include "data/volume_io/dicom_frames.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>
#include <map>
#include <type_traits>

#include "common/base/log.h"
#include "common/base/printable.h"
#include "common/memory/aligned_buffer.h"
#include "common/volume/memory_budget.h"
#include "data/volume_io/dicom_decoder.h"
#include "data/volume_io/payload.h"

namespace slabstream {
namespace {

bool IsUncompressed(const DicomImage& image) {
  return image.transfer_syntax == kImplicitLittleEndian || image.transfer_syntax == kExplicitLittleEndian ||
         image.transfer_syntax == kExplicitBigEndian || image.transfer_syntax == kDeflatedLittleEndian;
}

Status CheckFormat(const DicomImage& image) {
  const auto wrong = [&](const std::string& why) { return Status::InvalidArgument(image.path + ": " + why); };
  if (image.is_colour()) {
    return wrong(fmt::format("a colour image ({}, {} samples a pixel), must have 1 sample", image.photometric, image.samples_per_pixel));
  }
  const auto [allocated, stored, high, is_signed, is_float] = image.format;
  if (is_float) {
    if (allocated != 32 && allocated != 64) return wrong(fmt::format("BitsAllocated of float pixels is {}, must be 32 or 64", allocated));
    return IsUncompressed(image) ? Status::Ok() : wrong(fmt::format("float pixels of transfer syntax {}", image.transfer_syntax));
  }
  if (allocated != 1 && allocated != 8 && allocated != 16 && allocated != 32) {
    return wrong(fmt::format("BitsAllocated is {}, supported are 1, 8, 16 and 32", allocated));
  }
  if (stored < 1 || stored > allocated) return wrong(fmt::format("BitsStored is {}, must be in [1, BitsAllocated {}]", stored, allocated));
  if (high < stored - 1 || high >= allocated) {
    return wrong(fmt::format("HighBit is {}, must be in [BitsStored - 1, BitsAllocated - 1] = [{}, {}]", high, stored - 1, allocated - 1));
  }
  if (image.transfer_syntax == kExplicitBigEndian && image.pixels.words != (allocated > 8)) {
    return wrong(fmt::format("pixels of {} bits in big endian must {}be in words of 16 bits", allocated, allocated > 8 ? "" : "not "));
  }
  if (image.transfer_syntax == kExplicitBigEndian && allocated == 32) {
    return wrong("pixels of 32 bits in big endian, whose bytes some programs swap in words of 16 bits and others as a whole");
  }
  if (!IsUncompressed(image) && allocated == 1) {
    return wrong(fmt::format("compressed pixels of 1 bit (transfer syntax {}) are not supported", image.transfer_syntax));
  }
  if (!IsUncompressed(image) && !CanDecompress(image.transfer_syntax)) {
    return wrong(
        fmt::format("transfer syntax {} is not supported; supported: uncompressed pixels, {}", image.transfer_syntax, kCompressions));
  }
  return Status::Ok();
}

Status CheckRescale(const DicomImage& image) {
  for (const DicomFrame& frame : image.frames) {
    const auto& [slope, intercept] = frame.rescale;
    if (slope == 0 || !std::isfinite(slope) || !std::isfinite(intercept)) {
      return Status::InvalidArgument(
          fmt::format("{}: RescaleSlope is {:g}, RescaleIntercept {:g}, must be finite and the slope not 0", image.path, slope, intercept));
    }
  }
  if (!image.modality_lut) return Status::Ok();
  return Status::InvalidArgument(image.path + ": has a Modality LUT Sequence instead of a rescaling, which is not supported");
}

// The bits of a pixel that are stored, as a number: signed if Raw is.
template <class Raw>
Raw Stored(Raw raw, const DicomPixelFormat& format) {
  if constexpr (std::is_integral_v<Raw>) {
    using Bits = std::make_unsigned_t<Raw>;
    const auto at_top = Raw(Bits(Bits(raw) << (format.bits_allocated - 1 - format.high_bit)));
    return Raw(at_top >> (format.bits_allocated - format.bits_stored));
  } else {
    return raw;
  }
}

// Stored pixels to samples. `pixels` may be `out`, if a sample has the bytes of a pixel.
void ToSamples(std::span<const std::byte> pixels, const DicomImage& image, const ValueMapping& rescale, bool as_values, std::byte* out) {
  const DicomPixelFormat& format = image.format;
  VisitSampleType(format.type(), [&]<class Raw>(const Raw*) {
    for (std::size_t i = 0; i < pixels.size() / sizeof(Raw); ++i) {
      Raw raw{};
      std::memcpy(&raw, pixels.data() + i * sizeof(Raw), sizeof(Raw));
      const Raw stored = Stored(raw, format);
      if (as_values) {
        const auto value = float(rescale.FromStored(double(stored)));
        std::memcpy(out + i * sizeof(float), &value, sizeof(float));
      } else {
        std::memcpy(out + i * sizeof(Raw), &stored, sizeof(Raw));
      }
    }
  });
}

// The pixels of frames that are not compressed one by one.
class StoredFrames {
 public:
  // Of `image`, one byte a pixel or more, in this machine's byte order. Errors of ReadPayload.
  Status Read(const DicomImage& image, std::size_t frame, std::span<std::byte> out) {
    const std::int64_t first_bit = std::int64_t(frame) * image.frame_bits();
    if (image.format.bits_allocated > 1) {
      if (Status status = ReadBytes(image, first_bit / 8, out); !status.ok()) return status;
      const SampleType type = image.format.is_float ? image.format.type() : SampleType::kUint16;
      if (image.transfer_syntax == kExplicitBigEndian && (image.pixels.words || image.format.is_float)) SwapByteOrder(type, out);
      return Status::Ok();
    }
    bits_.resize(std::size_t((first_bit + image.frame_bits() + 7) / 8 - first_bit / 8));
    if (Status status = ReadBytes(image, first_bit / 8, bits_); !status.ok()) return status;
    for (std::size_t i = 0; i < out.size(); ++i) {
      const std::size_t bit = std::size_t(first_bit % 8) + i;
      out[i] = bits_[bit / 8] >> (bit % 8) & std::byte{1};
    }
    return Status::Ok();
  }

 private:
  // Of a deflated data set all pixels are decompressed at once.
  Status ReadBytes(const DicomImage& image, std::int64_t begin, std::span<std::byte> out) {
    const DicomPixelData& pixels = image.pixels;
    if (pixels.deflated_at == 0) return ReadPayload({.file = image.path, .offset = pixels.offset + begin}, out);
    if (inflated_of_ != &image) {
      inflated_of_ = nullptr;
      if (Status status = CheckFitsMemory(pixels.bytes, image.path); !status.ok()) return status;
      inflated_.resize(std::size_t(pixels.bytes));
      const Payload payload{
          .file = image.path, .offset = pixels.deflated_at, .skip = pixels.offset, .compression = Compression::kBareDeflate};
      if (Status status = ReadPayload(payload, inflated_); !status.ok()) return status;
      inflated_of_ = &image;
    }
    std::ranges::copy(std::span(inflated_).subspan(std::size_t(begin), out.size()), out.begin());
    return Status::Ok();
  }

  AlignedVector<std::byte> bits_, inflated_;
  const DicomImage* inflated_of_ = nullptr;
};

// What codecs print about frames becomes log lines, of the first frames alone.
class CodecTexts {
 public:
  ~CodecTexts() {
    if (frames_ > kMost) LogWarning(fmt::format("{}: the codec says something of {} more frames", path_, frames_ - kMost));
  }
  void Add(const DicomImage& image, std::size_t frame, const std::string& text) {
    if (text.empty() || ++frames_ > kMost) return;
    path_ = Printable(image.path);
    LogWarning(fmt::format("{}: frame {}: its compressed pixels may be damaged; the codec says: {}", path_, frame + 1, text));
  }

 private:
  static constexpr std::size_t kMost = 5;
  std::string path_;
  std::size_t frames_ = 0;
};

using FrameFragments = std::vector<std::vector<DicomFragment>>;

// The fragments of each frame of an encapsulated image. DataLoss: they cannot be told apart.
Result<FrameFragments> FragmentsOfFrames(const DicomImage& image) {
  Result<std::vector<DicomFragment>> listed = ListFragments(image.path, image.pixels);
  if (!listed.ok()) return listed.status();
  std::vector<DicomFragment>& all = *listed;
  const std::size_t frames = image.frames.size();
  const auto damaged = [&](const std::string& why) { return Status::DataLoss(image.path + ": truncated or damaged: " + why); };
  if (all.empty()) return damaged("the compressed pixels have no offset table");
  const DicomFragment table = all.front();
  all.erase(all.begin());
  if (all.size() < frames) return damaged(fmt::format("{} frames in {} fragments of compressed pixels", frames, all.size()));
  if (frames == 1) return FrameFragments{std::move(all)};
  FrameFragments of_frames;
  if (all.size() == frames) {
    for (const DicomFragment& fragment : all) of_frames.push_back({fragment});
    return of_frames;
  }
  // Frames begin at the fragments whose headers lie at the table's offsets from the first.
  if (table.second != std::int64_t(4 * frames))
    return damaged(fmt::format("{} frames in {} fragments need an offset table", frames, all.size()));
  std::vector<std::uint32_t> offsets(frames);
  std::ifstream file(image.path, std::ios::binary);
  file.seekg(table.first);
  file.read(reinterpret_cast<char*>(offsets.data()), table.second);
  if (file.gcount() != table.second) return damaged("the offset table cannot be read");
  const std::int64_t begin = all.front().first;
  std::size_t next = 0;
  for (const DicomFragment& fragment : all) {
    if (next < frames && fragment.first - begin == std::int64_t{offsets[next]}) {
      of_frames.emplace_back();
      ++next;
    }
    if (of_frames.empty()) return damaged("the offset table does not begin at the first fragment");
    of_frames.back().push_back(fragment);
  }
  if (next != frames) return damaged("the offset table does not fit the fragments");
  return of_frames;
}

}  // namespace

Status CheckFrames(const DicomImage& image) {
  if (Status status = CheckFormat(image); !status.ok()) return status;
  if (Status status = CheckRescale(image); !status.ok()) return status;
  if (image.pixels.offset == 0) return Status::InvalidArgument(image.path + ": has no Pixel Data");
  if (!image.trouble.ok()) return image.trouble;
  if (IsUncompressed(image) != image.pixels.encapsulated) {
    if (!image.pixels.encapsulated || image.frame_pixels() <= kMaxCompressedPixels) return Status::Ok();
    return Status::InvalidArgument(
        fmt::format("{}: {} x {} compressed pixels, limit {}", image.path, image.columns, image.rows, kMaxCompressedPixels));
  }
  return Status::DataLoss(fmt::format("{}: damaged: its pixels are {}, but its transfer syntax is {}", image.path,
                                      image.pixels.encapsulated ? "in fragments" : "not in fragments", image.transfer_syntax));
}

DicomSamples SamplesOf(std::span<const DicomFrameNumber> frames) {
  const auto rescale_of = [](const DicomFrameNumber& of) { return of.image->frames[of.frame].rescale; };
  const DicomFrameNumber& first = frames.front();
  const bool alike = std::ranges::all_of(frames, [&](const DicomFrameNumber& each) {
    return each.image->format.type() == first.image->format.type() && rescale_of(each) == rescale_of(first);
  });
  return alike ? DicomSamples{first.image->format.type(), rescale_of(first)} : DicomSamples{SampleType::kFloat32, {}, true};
}

struct DicomFrameReader::State {
  std::vector<DicomFrameNumber> frames;
  DicomSamples samples;
  DicomDecoder decoder;
  StoredFrames stored{};
  CodecTexts texts{};
  AlignedVector<std::byte> pixels{};
  std::size_t next = 0;
};

DicomFrameReader::DicomFrameReader(std::unique_ptr<State> state) : state_(std::move(state)) {}
DicomFrameReader::DicomFrameReader(DicomFrameReader&&) noexcept = default;
DicomFrameReader::~DicomFrameReader() = default;

Result<DicomFrameReader> DicomFrameReader::Start(std::vector<DicomFrameNumber> frames, const DicomSamples& samples) {
  // Compressed frames, in the order in which they are needed.
  std::vector<CompressedFrame> compressed;
  std::map<const DicomImage*, FrameFragments> fragments;
  for (const auto& [image, frame] : frames) {
    if (!image->pixels.encapsulated) continue;
    if (!fragments.contains(image)) {
      Result<FrameFragments> of_frames = FragmentsOfFrames(*image);
      if (!of_frames.ok()) return of_frames.status();
      fragments[image] = *std::move(of_frames);
    }
    compressed.push_back(
        {image->path, image->transfer_syntax, fragments[image][frame], image->columns, image->rows, image->format.bits_allocated});
  }
  Result<DicomDecoder> decoder = DicomDecoder::Start(std::move(compressed));
  if (!decoder.ok()) return decoder.status();
  return DicomFrameReader(std::make_unique<State>(State{std::move(frames), samples, *std::move(decoder)}));
}

Status DicomFrameReader::Read(std::span<std::byte> out) {
  const auto [image, frame] = state_->frames[state_->next++];
  AlignedVector<std::byte>& pixels = state_->pixels;
  pixels.resize(std::size_t(image->frame_pixels()) * BytesPerSample(image->format.type()));
  if (image->pixels.encapsulated) {
    const Result<std::string> text = state_->decoder.Read(pixels);
    if (!text.ok()) return text.status();
    state_->texts.Add(*image, frame, *text);
  } else if (Status status = state_->stored.Read(*image, frame, pixels); !status.ok()) {
    return status;
  }
  ToSamples(pixels, *image, image->frames[frame].rescale, state_->samples.as_values, out.data());
  return Status::Ok();
}

}  // namespace slabstream
