// slabstream-dicom-decoder: decompresses DICOM frames by GDCM for the program that starts it (dicom_decoder.h). It reads the frames from
// stdin, writes to stdout what the codec printed and the pixels of each, and ends early where a frame is damaged, takes too long or needs
// too much memory.
#include <fcntl.h>
#include <gdcmDataElement.h>
#include <gdcmJPEG2000Codec.h>
#include <gdcmJPEGCodec.h>
#include <gdcmJPEGLSCodec.h>
#include <gdcmRLECodec.h>
#include <gdcmSequenceOfFragments.h>
#include <gdcmTrace.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <iostream>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "data/volume_io/compressed_frame.h"

namespace slabstream {
namespace {

// What a compressed stream says of its pixels.
struct Stream {
  std::int64_t columns = 0, rows = 0;
  int components = 0, bits = 0;
  bool is_signed = false;
  bool cosines = false;  // of JPEG: lossy, so that GDCM has a library for 8 bits and one for 12
};

int ByteAt(std::string_view bytes, std::size_t at) { return static_cast<unsigned char>(bytes[at]); }
int ShortAt(std::string_view bytes, std::size_t at) { return ByteAt(bytes, at) << 8 | ByteAt(bytes, at + 1); }
std::int64_t LongAt(std::string_view bytes, std::size_t at) { return std::int64_t{ShortAt(bytes, at)} << 16 | ShortAt(bytes, at + 2); }

// The frame header of JPEG and JPEG-LS (ITU-T T.81, B.2.2).
std::optional<Stream> ReadJpegHeader(std::string_view bytes) {
  for (std::size_t at = 2; at + 10 <= bytes.size();) {
    if (ByteAt(bytes, at) != 0xff) return std::nullopt;
    const int marker = ByteAt(bytes, at + 1);
    if (marker == 0xff) {  // fill byte
      ++at;
      continue;
    }
    const bool frame = (marker >= 0xc0 && marker <= 0xcf && marker != 0xc4 && marker != 0xc8 && marker != 0xcc) || marker == 0xf7;
    if (frame) {
      return Stream{.columns = ShortAt(bytes, at + 7),
                    .rows = ShortAt(bytes, at + 5),
                    .components = ByteAt(bytes, at + 9),
                    .bits = ByteAt(bytes, at + 4),
                    .cosines = (marker & 3) != 3};
    }
    at += 2 + std::size_t(ShortAt(bytes, at + 2));
  }
  return std::nullopt;
}

// The image header of JPEG 2000 (ITU-T T.800, A.5.1).
std::optional<Stream> ReadJpeg2000Header(std::string_view bytes) {
  constexpr std::size_t kHeader = 45;
  if (bytes.size() < kHeader || LongAt(bytes, 0) != 0xff4fff51) return std::nullopt;
  const int depth = ByteAt(bytes, 42);
  return Stream{.columns = LongAt(bytes, 8) - LongAt(bytes, 16),
                .rows = LongAt(bytes, 12) - LongAt(bytes, 20),
                .components = ShortAt(bytes, 40),
                .bits = (depth & 0x7f) + 1,
                .is_signed = (depth & 0x80) != 0};
}

// RLE knows only bytes: they are the frame's own (PS3.5 annex G).
std::optional<Stream> ReadRleHeader(std::string_view bytes, const CompressedFrame& frame) {
  constexpr std::size_t kHeader = 64;
  if (bytes.size() < kHeader || ByteAt(bytes, 0) != frame.bits_allocated / 8) return std::nullopt;
  return Stream{.columns = frame.columns, .rows = frame.rows, .components = 1, .bits = frame.bits_allocated};
}

std::optional<Stream> ReadStreamHeader(DicomCodec codec, std::string_view bytes, const CompressedFrame& frame) {
  std::optional<Stream> stream = codec == DicomCodec::kRle        ? ReadRleHeader(bytes, frame)
                                 : codec == DicomCodec::kJpeg2000 ? ReadJpeg2000Header(bytes)
                                                                  : ReadJpegHeader(bytes);
  const bool fits = stream && stream->columns == frame.columns && stream->rows == frame.rows && stream->components == 1 &&
                    stream->bits >= 1 && stream->bits <= frame.bits_allocated;
  return fits ? stream : std::nullopt;
}

std::unique_ptr<gdcm::ImageCodec> MakeCodec(DicomCodec codec, const CompressedFrame& frame) {
  switch (codec) {
    case DicomCodec::kJpeg: return std::make_unique<gdcm::JPEGCodec>();
    case DicomCodec::kJpegLs: return std::make_unique<gdcm::JPEGLSCodec>();
    case DicomCodec::kJpeg2000: {
      auto jpeg_2000 = std::make_unique<gdcm::JPEG2000Codec>();
      jpeg_2000->SetNumberOfThreadsForDecompression(0);
      return jpeg_2000;
    }
    case DicomCodec::kRle: break;
  }
  auto rle = std::make_unique<gdcm::RLECodec>();
  rle->SetBufferLength(static_cast<unsigned long>(frame.bytes()));
  return rle;
}

// Samples of `from_bytes` each, in this machine's byte order, become wider ones.
std::string Widened(std::string_view samples, std::size_t from_bytes, std::size_t to_bytes, const Stream& stream) {
  std::string wide(samples.size() / from_bytes * to_bytes, '\0');
  for (std::size_t i = 0; i * from_bytes < samples.size(); ++i) {
    std::uint32_t bits = 0;
    std::memcpy(&bits, samples.data() + i * from_bytes, from_bytes);
    const bool negative = stream.is_signed && (bits >> (stream.bits - 1) & 1) != 0;
    if (negative) bits |= ~std::uint32_t{0} << (stream.bits - 1);
    std::memcpy(wide.data() + i * to_bytes, &bits, to_bytes);
  }
  return wide;
}

// The pixels of a frame; empty: damaged. GDCM trusts the header that it gets, so the header repeats what the stream says of itself.
std::string Decompressed(const CompressedFrame& frame, const std::string& bytes) {
  const DicomCodec codec_kind = FindDicomCodec(frame.transfer_syntax).value();
  const std::optional<Stream> stream = ReadStreamHeader(codec_kind, bytes, frame);
  if (!stream) return "";
  const std::size_t sample_bytes = stream->bits <= 8 ? 1 : stream->bits <= 16 ? 2 : 4;
  const auto bits = [](std::size_t count) { return static_cast<unsigned short>(count); };

  const std::unique_ptr<gdcm::ImageCodec> codec = MakeCodec(codec_kind, frame);
  const std::array<unsigned, 3> size = {unsigned(frame.columns), unsigned(frame.rows), 1};
  codec->SetDimensions(size.data());
  codec->SetNumberOfDimensions(2);
  codec->SetPlanarConfiguration(0);
  codec->SetPhotometricInterpretation(gdcm::PhotometricInterpretation::MONOCHROME2);
  const std::size_t allocated = codec_kind == DicomCodec::kJpeg && stream->cosines && stream->bits == 12 ? 12 : 8 * sample_bytes;
  codec->SetPixelFormat(gdcm::PixelFormat(1, bits(allocated), bits(std::size_t(stream->bits)), bits(std::size_t(stream->bits) - 1),
                                          bits(stream->is_signed ? 1 : 0)));
  gdcm::Fragment fragment;
  fragment.SetByteValue(bytes.data(), gdcm::VL(std::uint32_t(bytes.size())));
  const gdcm::SmartPointer<gdcm::SequenceOfFragments> fragments = new gdcm::SequenceOfFragments;
  fragments->AddFragment(fragment);
  gdcm::DataElement in(gdcm::Tag(0x7fe0, 0x0010)), out;
  in.SetValue(*fragments);
  if (!codec->Decode(in, out) || out.GetByteValue() == nullptr) return "";

  const gdcm::ByteValue& value = *out.GetByteValue();
  const std::size_t pixels = std::size_t(frame.columns) * std::size_t(frame.rows);
  const std::size_t wanted = std::size_t(frame.bits_allocated / 8);
  if (value.GetLength() < pixels * sample_bytes) return "";
  const std::string_view samples(value.GetPointer(), pixels * sample_bytes);
  return wanted == sample_bytes ? std::string(samples) : Widened(samples, sample_bytes, wanted, *stream);
}

// The stream of a frame; of JPEG 2000 without the boxes of a JP2 file that some writers leave around it.
std::string ReadFragments(const CompressedFrame& frame) {
  std::string bytes;
  std::ifstream file(frame.path, std::ios::binary);
  for (const auto& [offset, count] : frame.fragments) {
    const std::size_t begin = bytes.size();
    bytes.resize(begin + std::size_t(count));
    file.seekg(offset);
    file.read(bytes.data() + begin, count);
    if (file.gcount() != count) return "";
  }
  if (FindDicomCodec(frame.transfer_syntax) == DicomCodec::kJpeg2000) {
    bytes.erase(0, std::min(bytes.find("\xff\x4f\xff\x51"), bytes.size()));
  }
  return bytes;
}

bool WriteAll(int pipe, std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t written = ::write(pipe, bytes.data(), bytes.size());
    if (written <= 0) return false;
    bytes.remove_prefix(std::size_t(written));
  }
  return true;
}

constexpr int kPixels = 3;            // the descriptor of the pipe to whoever started this program
constexpr int kText = STDERR_FILENO;  // a file in memory: whatever codecs print, to stdout or stderr
constexpr unsigned kSeconds = 60;     // for a frame

// Ends with whoever started it, and has no open files but these two: nothing that a codec prints gets into the pipe.
bool Seclude() {
  (void)::prctl(PR_SET_PDEATHSIG, SIGKILL);
  // Descriptors that are opened later are above kPixels, or replace one of the first three.
  if (::dup2(STDOUT_FILENO, kPixels) < 0) return false;
  const int nothing = ::open("/dev/null", O_RDWR), text = ::memfd_create("text", 0);
  if (nothing < 0 || text < 0 || ::dup2(nothing, STDIN_FILENO) < 0) return false;
  if (::dup2(text, STDOUT_FILENO) < 0 || ::dup2(text, kText) < 0) return false;
  (void)::close_range(kPixels + 1, ~0U, 0);
  (void)std::signal(SIGXFSZ, SIG_IGN);  // so that a write beyond the limit fails, and no more
  const rlimit most = {kMostCodecText, kMostCodecText};
  return ::setrlimit(RLIMIT_FSIZE, &most) == 0;
}

// What was printed since the last call.
std::string TakeText() {
  (void)std::fflush(nullptr);
  std::string text(kMostCodecText, '\0');
  const ssize_t count = ::pread(kText, text.data(), text.size(), 0);
  text.resize(std::size_t(std::max<ssize_t>(count, 0)));
  (void)::ftruncate(kText, 0);
  (void)::lseek(kText, 0, SEEK_SET);
  return text;
}

void LimitMemory(std::int64_t frame_bytes) {
  const rlimit no_core = {0, 0};
  ::setrlimit(RLIMIT_CORE, &no_core);
  std::ifstream statm("/proc/self/statm");
  std::int64_t pages = 0;
  if (!(statm >> pages)) return;
  // Codecs keep a pixel in up to 4 bytes, several times.
  const std::int64_t bytes = pages * ::sysconf(_SC_PAGESIZE) + 64 * frame_bytes + (std::int64_t{256} << 20);
  const rlimit memory = {rlim_t(bytes), rlim_t(bytes)};
  ::setrlimit(RLIMIT_AS, &memory);
}

bool Decompress() {
  std::vector<CompressedFrame> frames;
  for (CompressedFrame frame; std::cin >> frame;) frames.push_back(std::move(frame));
  if (frames.empty() || !Seclude()) return false;
  gdcm::Trace::WarningOff();  // its own texts name its sources; those of the codecs say what is wrong
  gdcm::Trace::ErrorOff();
  LimitMemory(frames.front().bytes());
  for (const CompressedFrame& frame : frames) {
    const std::string bytes = ReadFragments(frame);
    ::alarm(kSeconds);
    const std::string pixels = bytes.empty() ? "" : Decompressed(frame, bytes);
    ::alarm(0);  // whoever reads may take its time
    const std::string text = TakeText();
    const auto text_bytes = std::uint32_t(text.size());
    const std::string_view size(reinterpret_cast<const char*>(&text_bytes), sizeof(text_bytes));
    if (!WriteAll(kPixels, size) || !WriteAll(kPixels, text) || pixels.empty() || !WriteAll(kPixels, pixels)) return false;
  }
  return true;
}

}  // namespace
}  // namespace slabstream

int main() {
  bool sound = false;
  try {
    sound = slabstream::Decompress();
  } catch (...) {  // no memory, or what GDCM throws
  }
  ::_exit(sound ? 0 : 1);
}
