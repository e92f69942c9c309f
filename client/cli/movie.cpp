#include "client/cli/movie.h"

#include <fmt/format.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <thread>

#include "common/base/check.h"
#include "common/base/printable.h"

namespace slabstream {
namespace {

constexpr char kEncoder[] = "ffmpeg";

// Players take colours as BT.709, at every size.
constexpr std::string_view kFilter =
    "scale=out_color_matrix=bt709:out_range=tv:flags=accurate_rnd+full_chroma_int+full_chroma_inp,format=yuv420p";
// GIF has 256 colours: each frame gets the ones that are best for it, so that ffmpeg need not keep all frames to choose them.
constexpr std::string_view kPalettes =
    "split[frame][copy];[copy]palettegen=stats_mode=single:reserve_transparent=0[palette];[frame][palette]paletteuse=new=1:dither=bayer:"
    "bayer_scale=4";

std::vector<std::string_view> Video(std::initializer_list<std::string_view> codec) {
  std::vector<std::string_view> arguments = {"-vf",   kFilter,      "-colorspace", "bt709",        "-color_primaries",
                                             "bt709", "-color_trc", "bt709",       "-color_range", "tv"};
  arguments.insert(arguments.end(), codec);
  return arguments;
}

}  // namespace

const std::vector<MovieFormat>& MovieFormats() {
  // H.264 with halved colour planes, which every player shows, needs even sides. Viewers of GIF slow down what is faster than 50 a second.
  static const std::vector<MovieFormat> formats = {
      {.ending = ".mp4",
       .container = "mp4",
       .encoding = Video({"-c:v", "libx264", "-crf", "18", "-movflags", "+faststart"}),
       .even_sides = true},
      {.ending = ".webm",
       .container = "webm",
       .encoding = Video({"-c:v", "libvpx-vp9", "-crf", "24", "-b:v", "0", "-deadline", "good", "-cpu-used", "4"})},
      {.ending = ".gif", .container = "gif", .encoding = {"-filter_complex", kPalettes}, .max_frames_per_second = 50},
  };
  return formats;
}

std::string MovieEndings() {
  std::string endings;
  for (const MovieFormat& format : MovieFormats()) {
    endings += endings.empty() ? "" : &format == &MovieFormats().back() ? " or " : ", ";
    endings += format.ending;
  }
  return endings;
}

const MovieFormat* MovieFormatOf(const std::string& path) {
  std::string ending = std::filesystem::path(path).extension().string();
  std::ranges::transform(ending, ending.begin(), [](unsigned char c) { return char(std::tolower(c)); });
  const auto found = std::ranges::find(MovieFormats(), ending, &MovieFormat::ending);
  return found == MovieFormats().end() ? nullptr : &*found;
}

Status CheckCanEncode(const MovieOptions& options) {
  const MovieFormat* const format = MovieFormatOf(options.path);
  CHECK(format != nullptr) << options.path;
  const auto [width, height] = options.size;
  if (format->even_sides && (width % 2 != 0 || height % 2 != 0)) {
    return Status::InvalidArgument(fmt::format("--size {}x{}: width and height of {} must be even, as in {}x{}", width, height,
                                               format->ending, width + width % 2, height + height % 2));
  }
  if (options.frames_per_second > format->max_frames_per_second) {
    return Status::InvalidArgument(fmt::format("--fps {:g} is out of range [{:g}, {:g}] for {}", options.frames_per_second,
                                               kMinFramesPerSecond, format->max_frames_per_second, format->ending));
  }
  if (!ProgramInPath(kEncoder).empty()) return Status::Ok();
  return Status::NotFound(fmt::format("--output '{}': the program {}, which makes movies, is not in $PATH (Debian package {})",
                                      options.path, kEncoder, kEncoder));
}

std::vector<std::string> EncoderArguments(const MovieOptions& options, const std::string& output) {
  const MovieFormat& format = *MovieFormatOf(options.path);
  const std::string size = fmt::format("{}x{}", options.size.width, options.size.height);
  const std::string rate = fmt::format("{}", options.frames_per_second);
  std::vector<std::string> arguments = {"-hide_banner", "-nostats", "-loglevel", "error", "-xerror"};  // each error counts
  arguments.insert(arguments.end(), {"-f", "rawvideo", "-pixel_format", "rgb24", "-video_size", size});
  arguments.insert(arguments.end(), {"-framerate", rate, "-i", "pipe:0"});
  arguments.insert(arguments.end(), format.encoding.begin(), format.encoding.end());
  // No dates and versions in the file: the same frames make the same bytes.
  arguments.insert(arguments.end(), {"-map_metadata", "-1", "-fflags", "+bitexact", "-flags:v", "+bitexact"});
  arguments.insert(arguments.end(), {"-f", std::string(format.container), "-y", "file:" + output});
  return arguments;
}

Movie::Descriptor::~Descriptor() {
  if (number_ >= 0) ::close(number_);
}

Result<std::unique_ptr<Movie>> Movie::Start(const MovieOptions& options) {
  if (Status status = CheckCanEncode(options); !status.ok()) return status;
  Result<OutputFile> file = OutputFile::Create(options.path);
  if (!file.ok()) return file.status();
  int ends[2] = {-1, -1};
  const bool connected = ::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends) == 0;
  Descriptor frames(ends[0]), input(ends[1]), messages(connected ? ::memfd_create("ffmpeg", MFD_CLOEXEC) : -1);
  if (messages.number() < 0) return Status::Unavailable(fmt::format("cannot start {}: {}", kEncoder, std::strerror(errno)));
  std::vector<std::string> command = EncoderArguments(options, file->written_path());
  command.insert(command.begin(), ProgramInPath(kEncoder));
  Result<Child> encoder = Child::Start(
      {.command = std::move(command), .log_path = fmt::format("/proc/self/fd/{}", messages.number()), .input = input.number()});
  if (!encoder.ok()) return encoder.status();
  return std::unique_ptr<Movie>(new Movie(options, *std::move(file), *std::move(encoder), std::move(frames), std::move(messages)));
}

Movie::Movie(const MovieOptions& options, OutputFile file, Child encoder, Descriptor frames, Descriptor messages)
    : options_(options), file_(std::move(file)), encoder_(std::move(encoder)), frames_(std::move(frames)), messages_(std::move(messages)) {}

Movie::~Movie() {
  Abandon();
  encoder_.Terminate(std::chrono::seconds(1));
}

void Movie::Abandon() {
  abandoned_ = true;
  ::shutdown(frames_.number(), SHUT_RDWR);  // ends a Put that waits for ffmpeg to read
}

Status Movie::Put(const Picture& picture, const FrameJob&) {
  CHECK(picture.final && picture.size == options_.size);
  const Result<ComposedPicture> composed = ComposedPicture::Make(picture.image, picture.size, options_.format, picture.geometry);
  if (!composed.ok()) return composed.status();
  const std::vector<std::byte> frame = MovieFrame(*composed);
  for (std::span<const std::byte> rest = frame; !rest.empty();) {
    const ssize_t count = ::send(frames_.number(), rest.data(), rest.size(), MSG_NOSIGNAL);
    if (count >= 0) {
      rest = rest.subspan(std::size_t(count));
    } else if (errno != EINTR) {
      const std::optional<ChildEnd> end = WaitForEnd(std::chrono::seconds(5));
      return Failure(end ? end->description : "takes no more frames");
    }
  }
  return Status::Ok();
}

Status Movie::Finish() {
  ::shutdown(frames_.number(), SHUT_WR);
  const std::optional<ChildEnd> end = WaitForEnd(Duration::max());
  if (!end) return Status::Cancelled("interrupted");
  if (end->exit_status != 0) return Failure(end->description);
  // A socket whose other end was closed before all was read says so.
  char byte = 0;
  if (::recv(frames_.number(), &byte, 1, MSG_DONTWAIT) < 0) return Failure("ended before it had read all frames");
  return file_.Finish();
}

std::optional<ChildEnd> Movie::WaitForEnd(Duration patience) {
  const Time begin = MonotonicNow();
  while (!abandoned_) {
    if (std::optional<ChildEnd> end = encoder_.Ended()) return end;
    if (MonotonicNow() - begin > patience) break;
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  return std::nullopt;
}

Status Movie::Failure(const std::string& what) const {
  const std::string last = Printable(LastLogLine(fmt::format("/proc/self/fd/{}", messages_.number())));
  return Status::Unavailable(fmt::format("cannot write '{}': {} {}{}{}", options_.path, kEncoder, what, last.empty() ? "" : ": ", last));
}

}  // namespace slabstream
