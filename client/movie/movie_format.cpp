#include "client/movie/movie_format.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <initializer_list>

namespace slabstream {
namespace {

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
  // A stream of MP4 has a box of its own for each frame, and the encoder looks a few frames ahead only, so that it comes evenly.
  static const std::vector<MovieFormat> formats = {
      {.ending = ".mp4",
       .container = "mp4",
       .encoding = Video({"-c:v", "libx264", "-crf", "18"}),
       .of_file = {"-movflags", "+faststart"},
       .of_stream = {"-rc-lookahead", "8", "-movflags", "+empty_moov+default_base_moof+frag_every_frame"},
       .even_sides = true},
      {.ending = ".webm",
       .container = "webm",
       .encoding = Video({"-c:v", "libvpx-vp9", "-crf", "24", "-b:v", "0", "-deadline", "good", "-cpu-used", "4"}),
       .of_file = {},
       .of_stream = {}},
      {.ending = ".gif",
       .container = "gif",
       .encoding = {"-filter_complex", kPalettes},
       .of_file = {},
       .of_stream = {},
       .max_frames_per_second = 50},
  };
  return formats;
}

const MovieFormat& StreamFormat() { return MovieFormats().front(); }

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

Status CheckShape(const MovieFormat& format, const MovieShape& shape) {
  const auto [width, height] = shape.size;
  if (format.even_sides && (width % 2 != 0 || height % 2 != 0)) {
    return Status::InvalidArgument(fmt::format("--size {}x{}: width and height of {} must be even, as in {}x{}", width, height,
                                               format.ending, width + width % 2, height + height % 2));
  }
  if (shape.frames_per_second > format.max_frames_per_second) {
    return Status::InvalidArgument(fmt::format("--fps {:g} is out of range [{:g}, {:g}] for {}", shape.frames_per_second,
                                               kMinFramesPerSecond, format.max_frames_per_second, format.ending));
  }
  return Status::Ok();
}

}  // namespace slabstream
