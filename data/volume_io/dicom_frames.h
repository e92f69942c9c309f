// The pixels of DICOM frames as samples in memory. Uncompressed ones are read from the file; compressed ones are decompressed by GDCM
// (dicom_decoder.h).
#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <vector>

#include "common/base/status.h"
#include "data/volume_io/dicom_image.h"

namespace slabstream {

// Pixels of a compressed frame, at most: whether it has more could only be told by decompressing it.
inline constexpr std::int64_t kMaxCompressedPixels = std::int64_t{1} << 26;

// Whether the frames of the image can be read: InvalidArgument: colours, a format of pixels, a transfer syntax or a rescaling that is not
// supported; DataLoss: the file has fewer pixels than it claims. Messages name the file.
Status CheckFrames(const DicomImage& image);

struct DicomFrameNumber {
  const DicomImage* image = nullptr;
  std::size_t frame = 0;
};

// What the samples of a volume of these frames are. If all have one format of pixels and one rescaling, samples are the stored pixels.
// Else, as with PET, where each slice has a scale of its own, they are data values as float32.
struct DicomSamples {
  SampleType type = SampleType::kUint16;
  ValueMapping rescale;
  bool as_values = false;  // data values, not stored pixels
};
DicomSamples SamplesOf(std::span<const DicomFrameNumber> frames);

// The frames of a volume, one after the other. One thread at a time.
class DicomFrameReader {
 public:
  // All frames have passed CheckFrames, are of the same size, and their images outlive this. DataLoss: damaged. Unavailable: no process can
  // be started.
  static Result<DicomFrameReader> Start(std::vector<DicomFrameNumber> frames, const DicomSamples& samples);
  DicomFrameReader(DicomFrameReader&&) noexcept;
  ~DicomFrameReader();

  // The samples of the next frame. What a codec says of it is logged as a warning that names file and frame. DataLoss: damaged.
  // ResourceExhausted: deflated pixels do not fit the memory.
  Status Read(std::span<std::byte> out);

 private:
  struct State;
  explicit DicomFrameReader(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace slabstream
