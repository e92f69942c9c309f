// Movies: the program ffmpeg encodes them. Frames go to its standard input in their order, as bytes of red, green and blue.
#pragma once

#include <atomic>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "client/cli/picture_sink.h"
#include "client/image_io/composed_picture.h"
#include "client/service/process.h"
#include "common/base/files.h"
#include "common/base/status.h"

namespace slabstream {

inline constexpr double kMinFramesPerSecond = 0.1, kMaxFramesPerSecond = 120;

struct MovieFormat {
  std::string_view ending;                 // ".mp4"
  std::string_view container;              // as ffmpeg's -f takes it
  std::vector<std::string_view> encoding;  // further arguments of ffmpeg
  bool even_sides = false;                 // width and height must be even
  double max_frames_per_second = kMaxFramesPerSecond;
};
// The only list.
const std::vector<MovieFormat>& MovieFormats();
std::string MovieEndings();  // ".mp4, .webm or .gif"

// The format that the ending says, in any case; null: the path names no movie.
const MovieFormat* MovieFormatOf(const std::string& path);

struct MovieOptions {
  std::string path;  // of a movie, as MovieFormatOf has it
  ImageSize size;    // of all frames
  double frames_per_second = 25;
  PictureFormat format;  // behind whatever the background lets through lies black
};

// For a message before the work begins. InvalidArgument, naming the option: the size or the frames per second are not for this format.
// NotFound: ffmpeg is not in $PATH; the message says what to install.
Status CheckCanEncode(const MovieOptions& options);

// The arguments with which ffmpeg reads such frames and writes the file `output`. Pure.
std::vector<std::string> EncoderArguments(const MovieOptions& options, const std::string& output);

// The file appears, and takes the place of an older one, when Finish has succeeded; else nothing is left of it. The same frames make the
// same bytes with the same ffmpeg on the same machine.
//
// Errors are Unavailable and name the path: ffmpeg ended, with the last line that it said, or the file cannot be written.
class Movie : public PictureSink {
 public:
  // Starts ffmpeg, which waits for the first frame. The calling thread must be there as long as the process (Child). Errors of
  // CheckCanEncode too.
  static Result<std::unique_ptr<Movie>> Start(const MovieOptions& options);
  ~Movie() override;  // ends ffmpeg if it still runs

  bool in_order() const override { return true; }
  Status Put(const Picture& picture, const FrameJob& job) override;
  Status Finish() override;
  void Abandon() override;

 private:
  // A descriptor of its own.
  class Descriptor {
   public:
    explicit Descriptor(int number) : number_(number) {}
    Descriptor(Descriptor&& other) noexcept : number_(std::exchange(other.number_, -1)) {}
    Descriptor& operator=(Descriptor&&) = delete;
    ~Descriptor();
    int number() const { return number_; }

   private:
    int number_;
  };

  Movie(const MovieOptions& options, OutputFile file, Child encoder, Descriptor frames, Descriptor messages);
  // Waits for ffmpeg's end; null: Abandon was called, or it goes on for longer than `patience`.
  std::optional<ChildEnd> WaitForEnd(Duration patience);
  Status Failure(const std::string& what) const;

  const MovieOptions options_;
  OutputFile file_;
  Child encoder_;
  const Descriptor frames_;    // a socket to ffmpeg's stdin: unlike a pipe it never raises SIGPIPE
  const Descriptor messages_;  // a file in memory, where ffmpeg's stderr goes
  std::atomic<bool> abandoned_ = false;
};

}  // namespace slabstream
