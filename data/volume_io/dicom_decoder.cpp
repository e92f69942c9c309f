#include "data/volume_io/dicom_decoder.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <gdcmDataElement.h>
#include <gdcmJPEG2000Codec.h>
#include <gdcmJPEGCodec.h>
#include <gdcmJPEGLSCodec.h>
#include <gdcmRLECodec.h>
#include <gdcmSequenceOfFragments.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <exception>
#include <fstream>
#include <memory>
#include <optional>
#include <string_view>
#include <thread>

namespace slabstream {
namespace {

enum class Codec { kJpeg, kJpegLs, kJpeg2000, kRle };

struct Compression {
  std::string_view transfer_syntax;
  Codec codec;
};

constexpr std::array<Compression, 9> kCompressionList = {{
    {"1.2.840.10008.1.2.4.50", Codec::kJpeg},
    {"1.2.840.10008.1.2.4.51", Codec::kJpeg},
    {"1.2.840.10008.1.2.4.57", Codec::kJpeg},
    {"1.2.840.10008.1.2.4.70", Codec::kJpeg},
    {"1.2.840.10008.1.2.4.80", Codec::kJpegLs},
    {"1.2.840.10008.1.2.4.81", Codec::kJpegLs},
    {"1.2.840.10008.1.2.4.90", Codec::kJpeg2000},
    {"1.2.840.10008.1.2.4.91", Codec::kJpeg2000},
    {"1.2.840.10008.1.2.5", Codec::kRle},
}};

const Compression* FindCompression(const std::string& transfer_syntax) {
  const auto found = std::ranges::find(kCompressionList, transfer_syntax, &Compression::transfer_syntax);
  return found == kCompressionList.end() ? nullptr : &*found;
}

// What a compressed stream says of its pixels.
struct Stream {
  std::int64_t columns = 0, rows = 0;
  int components = 0, bits = 0;
  bool is_signed = false;
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
                    .bits = ByteAt(bytes, at + 4)};
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
  if (bytes.size() < kHeader || ByteAt(bytes, 0) != frame.format.bits_allocated / 8) return std::nullopt;
  return Stream{.columns = frame.columns, .rows = frame.rows, .components = 1, .bits = frame.format.bits_allocated};
}

std::optional<Stream> ReadStreamHeader(Codec codec, std::string_view bytes, const CompressedFrame& frame) {
  std::optional<Stream> stream = codec == Codec::kRle        ? ReadRleHeader(bytes, frame)
                                 : codec == Codec::kJpeg2000 ? ReadJpeg2000Header(bytes)
                                                             : ReadJpegHeader(bytes);
  const bool fits = stream && stream->columns == frame.columns && stream->rows == frame.rows && stream->components == 1 &&
                    stream->bits >= 1 && stream->bits <= frame.format.bits_allocated;
  return fits ? stream : std::nullopt;
}

std::unique_ptr<gdcm::ImageCodec> MakeCodec(Codec codec, const CompressedFrame& frame) {
  switch (codec) {
    case Codec::kJpeg: return std::make_unique<gdcm::JPEGCodec>();
    case Codec::kJpegLs: return std::make_unique<gdcm::JPEGLSCodec>();
    case Codec::kJpeg2000: {
      auto jpeg_2000 = std::make_unique<gdcm::JPEG2000Codec>();
      jpeg_2000->SetNumberOfThreadsForDecompression(0);
      return jpeg_2000;
    }
    case Codec::kRle: break;
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
  const Codec codec_kind = FindCompression(frame.transfer_syntax)->codec;
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
  codec->SetPixelFormat(gdcm::PixelFormat(1, bits(8 * sample_bytes), bits(std::size_t(stream->bits)), bits(std::size_t(stream->bits) - 1),
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
  const std::size_t wanted = std::size_t(frame.format.bits_allocated / 8);
  if (value.GetLength() < pixels * sample_bytes) return "";
  const std::string_view samples(value.GetPointer(), pixels * sample_bytes);
  return wanted == sample_bytes ? std::string(samples) : Widened(samples, sample_bytes, wanted, *stream);
}

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

// Closes all that this process has inherited from its parent but `pipe`, which becomes descriptor 3.
bool Seclude(int pipe, std::int64_t frame_bytes) {
  constexpr int kPipe = 3;
  (void)::prctl(PR_SET_PDEATHSIG, SIGKILL);
  for (const int number : {SIGALRM, SIGTERM, SIGINT, SIGPIPE, SIGABRT}) ::signal(number, SIG_DFL);
  sigset_t none;
  ::sigemptyset(&none);
  ::sigprocmask(SIG_SETMASK, &none, nullptr);
  const int nothing = ::open("/dev/null", O_RDWR);
  if (nothing < 0 || ::dup2(nothing, 0) < 0 || ::dup2(nothing, 1) < 0 || ::dup2(nothing, 2) < 0) return false;
  if (pipe != kPipe && ::dup2(pipe, kPipe) < 0) return false;
  (void)::close_range(kPipe + 1, ~0U, 0);

  const rlimit no_core = {0, 0};
  ::setrlimit(RLIMIT_CORE, &no_core);
  std::ifstream statm("/proc/self/statm");
  std::int64_t pages = 0;
  if (!(statm >> pages)) return true;
  // Codecs keep a pixel in up to 4 bytes, several times.
  const std::int64_t bytes = pages * ::sysconf(_SC_PAGESIZE) + 64 * frame_bytes + (std::int64_t{256} << 20);
  const rlimit memory = {rlim_t(bytes), rlim_t(bytes)};
  ::setrlimit(RLIMIT_AS, &memory);
  return true;
}

// What a child does: decompresses every `step`-th frame from `first` on into the pipe. Ends early where a frame is damaged.
[[noreturn]] void RunChild(const std::vector<CompressedFrame>& frames, std::size_t first, std::size_t step, int pipe) {
  constexpr unsigned kSeconds = 60;  // for a frame
  constexpr int kPipe = 3;
  bool sound = Seclude(pipe, frames[first].bytes());
  for (std::size_t i = first; sound && i < frames.size(); i += step) {
    try {
      const std::string bytes = ReadFragments(frames[i]);
      ::alarm(kSeconds);
      const std::string pixels = bytes.empty() ? "" : Decompressed(frames[i], bytes);
      ::alarm(0);  // the parent may take its time
      sound = !pixels.empty() && WriteAll(kPipe, pixels);
    } catch (...) {
      sound = false;
    }
  }
  ::_exit(sound ? 0 : 1);
}

}  // namespace

bool CanDecompress(const std::string& transfer_syntax) { return FindCompression(transfer_syntax) != nullptr; }

Result<DicomDecoder> DicomDecoder::Start(std::vector<CompressedFrame> frames) {
  constexpr std::size_t kMostProcesses = 8, kFramesEach = 8;
  DicomDecoder decoder;
  decoder.frames_ = std::move(frames);
  const std::size_t cores = std::max(1U, std::thread::hardware_concurrency());
  const std::size_t count = std::min({cores, kMostProcesses, (decoder.frames_.size() + kFramesEach - 1) / kFramesEach});
  for (std::size_t i = 0; i < count; ++i) {
    std::array<int, 2> ends = {-1, -1};
    const pid_t pid = ::pipe2(ends.data(), O_CLOEXEC) == 0 ? ::fork() : -1;
    if (pid == 0) RunChild(decoder.frames_, i, count, ends[1]);
    if (pid < 0) {
      const int error = errno;
      for (const int end : ends) ::close(end);
      return Status::Unavailable(fmt::format("cannot start a process that decompresses pixels: {}", std::strerror(error)));
    }
    ::close(ends[1]);
    decoder.processes_.push_back({pid, ends[0]});
  }
  return decoder;
}

DicomDecoder::~DicomDecoder() {
  for (const Process& process : processes_) {
    ::close(process.pipe);
    ::kill(process.pid, SIGKILL);
    while (::waitpid(process.pid, nullptr, 0) < 0 && errno == EINTR) {
    }
  }
}

Status DicomDecoder::Read(std::span<std::byte> out) {
  const CompressedFrame& frame = frames_[next_];
  const int pipe = processes_[next_ % processes_.size()].pipe;
  ++next_;
  while (!out.empty()) {
    const ssize_t count = ::read(pipe, out.data(), out.size());
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) {
      return Status::DataLoss(fmt::format("{}: truncated or damaged: its compressed pixels cannot be read (transfer syntax {})", frame.path,
                                          frame.transfer_syntax));
    }
    out = out.subspan(std::size_t(count));
  }
  return Status::Ok();
}

}  // namespace slabstream
