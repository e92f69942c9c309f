// Formats of movies.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "common/base/status.h"
#include "common/view/camera.h"

namespace slabstream {

inline constexpr double kMinFramesPerSecond = 0.1, kMaxFramesPerSecond = 120;

struct MovieFormat {
  std::string_view ending;                  // ".mp4"
  std::string_view container;               // as ffmpeg's -f takes it
  std::vector<std::string_view> encoding;   // further arguments of ffmpeg
  std::vector<std::string_view> of_file;    // ffmpeg's arguments for a movie in a file
  std::vector<std::string_view> of_stream;  // ffmpeg's arguments for a movie that is read while it is made
  bool even_sides = false;                  // width and height must be even
  double max_frames_per_second = kMaxFramesPerSecond;
};
// The only list.
const std::vector<MovieFormat>& MovieFormats();
// The first of them: the one that can be read while it is made.
const MovieFormat& StreamFormat();
std::string MovieEndings();  // ".mp4, .webm or .gif"

// The format that the ending says, in any case; null: the path names no movie.
const MovieFormat* MovieFormatOf(const std::string& path);

struct MovieShape {
  ImageSize size;  // the size of every frame
  double frames_per_second = 25;
};

// InvalidArgument, naming the option: the size or the frames per second are not for this format.
Status CheckShape(const MovieFormat& format, const MovieShape& shape);

}  // namespace slabstream
