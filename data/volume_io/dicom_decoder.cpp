#include "data/volume_io/dicom_decoder.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <signal.h>
#include <spawn.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <sstream>
#include <thread>

#include "common/files/file_descriptor.h"
#include "common/files/program_beside.h"

namespace slabstream {
namespace {

Status CannotStart(const std::string& why) {
  return Status::Unavailable(fmt::format("cannot start a process that decompresses pixels: {}", why));
}

// Stdin, stdout and no other files, no signal blocked or ignored. Returns an errno; 0: `pid` runs.
int Spawn(const std::string& program, int in, int out, pid_t& pid) {
  posix_spawn_file_actions_t files;
  posix_spawnattr_t attributes;
  sigset_t none, all;
  ::sigemptyset(&none);
  ::sigfillset(&all);
  ::posix_spawn_file_actions_init(&files);
  ::posix_spawnattr_init(&attributes);
  ::posix_spawn_file_actions_adddup2(&files, in, STDIN_FILENO);
  ::posix_spawn_file_actions_adddup2(&files, out, STDOUT_FILENO);
  ::posix_spawnattr_setsigmask(&attributes, &none);
  ::posix_spawnattr_setsigdefault(&attributes, &all);
  ::posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF);
  std::array<char*, 2> arguments = {const_cast<char*>(program.c_str()), nullptr};
  const int error = ::posix_spawn(&pid, program.c_str(), &files, &attributes, arguments.data(), environ);
  ::posix_spawnattr_destroy(&attributes);
  ::posix_spawn_file_actions_destroy(&files);
  return error;
}

// A file in memory. It has no name, and nobody has to read it while it is written. Negative, with errno: it cannot be written.
FileDescriptor FileOf(const std::string& text) {
  FileDescriptor file(::memfd_create("frames", MFD_CLOEXEC));
  const bool written = ::write(file.number(), text.data(), text.size()) == ssize_t(text.size()) && ::lseek(file.number(), 0, SEEK_SET) == 0;
  return written ? std::move(file) : FileDescriptor();
}

// Fills `out`; false: the process has ended.
bool ReadAll(int pipe, std::span<std::byte> out) {
  while (!out.empty()) {
    const ssize_t count = ::read(pipe, out.data(), out.size());
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) return false;
    out = out.subspan(std::size_t(count));
  }
  return true;
}

// The words of a text, in printable ASCII.
std::string InOneLine(const std::string& text) {
  std::istringstream words(text);
  std::string line, word;
  while (words >> word) line += (line.empty() ? "" : " ") + word;
  std::ranges::replace_if(
      line, [](char c) { return c < ' ' || c > '~'; }, '?');
  constexpr std::size_t kMost = 200;
  return line.size() <= kMost ? line : line.substr(0, kMost) + " ...";
}

}  // namespace

bool CanDecompress(const std::string& transfer_syntax) { return FindDicomCodec(transfer_syntax).has_value(); }

Result<DicomDecoder> DicomDecoder::Start(std::vector<CompressedFrame> frames) {
  constexpr std::size_t kMostProcesses = 8, kFramesEach = 8;
  DicomDecoder decoder;
  decoder.frames_ = std::move(frames);
  const std::size_t cores = std::max(1U, std::thread::hardware_concurrency());
  const std::size_t count = std::min({cores, kMostProcesses, (decoder.frames_.size() + kFramesEach - 1) / kFramesEach});
  if (count == 0) return decoder;
  const Result<std::string> program = ProgramBeside(kDicomDecoderProgram);
  if (!program.ok()) return CannotStart(program.status().message());
  for (std::size_t i = 0; i < count; ++i) {
    std::ostringstream text;
    for (std::size_t frame = i; frame < decoder.frames_.size(); frame += count) text << decoder.frames_[frame];
    const FileDescriptor in = FileOf(text.str());
    std::array<int, 2> ends = {-1, -1};
    if (in.number() < 0 || ::pipe2(ends.data(), O_CLOEXEC) != 0) return CannotStart(std::strerror(errno));
    FileDescriptor from_it(ends[0]);
    const FileDescriptor to_us(ends[1]);
    pid_t pid = -1;
    if (const int error = Spawn(*program, in.number(), to_us.number(), pid); error != 0) return CannotStart(std::strerror(error));
    decoder.processes_.push_back({pid, from_it.Release()});
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

Result<std::string> DicomDecoder::Read(std::span<std::byte> out) {
  const CompressedFrame& frame = frames_[next_];
  const int pipe = processes_[next_ % processes_.size()].pipe;
  ++next_;
  std::uint32_t text_bytes = 0;
  std::string text;
  bool whole = ReadAll(pipe, std::as_writable_bytes(std::span(&text_bytes, 1))) && text_bytes <= kMostCodecText;
  if (whole) {
    text.resize(text_bytes);
    whole = ReadAll(pipe, std::as_writable_bytes(std::span(text))) && ReadAll(pipe, out);
    text = InOneLine(text);
  }
  if (whole) return text;
  return Status::DataLoss(fmt::format("{}: truncated or damaged: its compressed pixels cannot be read (transfer syntax {}){}", frame.path,
                                      frame.transfer_syntax, text.empty() ? "" : "; the codec says: " + text));
}

}  // namespace slabstream
