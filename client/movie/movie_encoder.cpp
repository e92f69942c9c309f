#include "client/movie/movie_encoder.h"

#include <fmt/format.h>
#include <sys/mman.h>
#include <sys/socket.h>

#include <cerrno>
#include <chrono>
#include <cstring>
#include <thread>
#include <utility>
#include <vector>

#include "common/base/printable.h"

namespace slabstream {
namespace {

constexpr char kEncoder[] = "ffmpeg";

std::vector<std::string> Command(const MovieFormat& format, const MovieShape& shape, const std::string& path) {
  const auto [width, height] = shape.size;
  std::vector<std::string> command = {
      ProgramInPath(kEncoder), "-hide_banner", "-nostats", "-loglevel", "error", "-xerror"};  // each error counts
  command.insert(command.end(), {"-f", "rawvideo", "-pixel_format", "rgb24", "-video_size", fmt::format("{}x{}", width, height)});
  command.insert(command.end(), {"-framerate", fmt::format("{}", shape.frames_per_second), "-i", "pipe:0"});
  command.insert(command.end(), format.encoding.begin(), format.encoding.end());
  const std::vector<std::string_view>& more = path.empty() ? format.of_stream : format.of_file;
  command.insert(command.end(), more.begin(), more.end());
  // No dates and versions in the movie: the same frames make the same bytes.
  command.insert(command.end(), {"-map_metadata", "-1", "-fflags", "+bitexact", "-flags:v", "+bitexact"});
  command.insert(command.end(), {"-f", std::string(format.container), "-y", path.empty() ? "pipe:1" : "file:" + path});
  return command;
}

std::string LogPath(const FileDescriptor& messages) { return fmt::format("/proc/self/fd/{}", messages.number()); }

}  // namespace

Status CheckHasMovieEncoder() {
  if (!ProgramInPath(kEncoder).empty()) return Status::Ok();
  return Status::NotFound(fmt::format("the program {}, which makes movies, is not in $PATH (Debian package {})", kEncoder, kEncoder));
}

Result<std::unique_ptr<MovieEncoder>> MovieEncoder::Start(const MovieFormat& format, const MovieShape& shape, const std::string& path) {
  if (Status status = CheckShape(format, shape); !status.ok()) return status;
  if (Status status = CheckHasMovieEncoder(); !status.ok()) return status;
  int ends[2] = {-1, -1};
  const bool connected = ::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends) == 0;
  FileDescriptor frames(ends[0]), input(ends[1]), messages(connected ? ::memfd_create(kEncoder, MFD_CLOEXEC) : -1);
  if (messages.number() < 0) return Status::Unavailable(fmt::format("cannot start {}: {}", kEncoder, std::strerror(errno)));
  Result<Child> encoder = Child::Start({.command = Command(format, shape, path), .log_path = LogPath(messages), .input = input.number()});
  if (!encoder.ok()) return encoder.status();
  return std::unique_ptr<MovieEncoder>(new MovieEncoder(*std::move(encoder), std::move(frames), std::move(messages)));
}

MovieEncoder::MovieEncoder(Child encoder, FileDescriptor frames, FileDescriptor messages)
    : encoder_(std::move(encoder)), frames_(std::move(frames)), messages_(std::move(messages)) {}

MovieEncoder::~MovieEncoder() {
  Abandon();
  encoder_.Terminate(std::chrono::seconds(1));
}

void MovieEncoder::Abandon() {
  abandoned_ = true;
  ::shutdown(frames_.number(), SHUT_RDWR);  // ends a Put that waits for ffmpeg to read
}

Status MovieEncoder::Put(std::span<const std::byte> frame) {
  for (std::span<const std::byte> rest = frame; !rest.empty();) {
    const ssize_t count = ::send(frames_.number(), rest.data(), rest.size(), MSG_NOSIGNAL);
    if (count >= 0) {
      rest = rest.subspan(std::size_t(count));
    } else if (errno != EINTR) {
      const std::optional<ChildEnd> end = WaitForEnd(std::chrono::seconds(5));
      return abandoned_ ? Status::Cancelled("interrupted") : Failure(end ? end->description : "takes no more frames");
    }
  }
  return Status::Ok();
}

Status MovieEncoder::Finish() {
  ::shutdown(frames_.number(), SHUT_WR);
  const std::optional<ChildEnd> end = WaitForEnd(Duration::max());
  if (!end) return Status::Cancelled("interrupted");
  if (end->exit_status != 0) return Failure(end->description);
  // A socket whose other end was closed before all was read says so.
  char byte = 0;
  if (::recv(frames_.number(), &byte, 1, MSG_DONTWAIT) < 0) return Failure("ended before it had read all frames");
  return Status::Ok();
}

std::optional<ChildEnd> MovieEncoder::WaitForEnd(Duration patience) {
  const Time begin = MonotonicNow();
  while (!abandoned_) {
    if (std::optional<ChildEnd> end = encoder_.Ended()) return end;
    if (MonotonicNow() - begin > patience) break;
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  return std::nullopt;
}

Status MovieEncoder::Failure(const std::string& what) const {
  const std::string last = Printable(LastLogLine(LogPath(messages_)));
  return Status::Unavailable(fmt::format("{} {}{}{}", kEncoder, what, last.empty() ? "" : ": ", last));
}

}  // namespace slabstream
