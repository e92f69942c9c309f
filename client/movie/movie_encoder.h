// MovieEncoder: the program ffmpeg, at work on one movie. Frames go to its standard input in their order, as bytes of red, green and blue
// (MovieFrame). The same frames make the same bytes with the same ffmpeg on the same machine.
#pragma once

#include <atomic>
#include <cstddef>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "client/movie/movie_format.h"
#include "client/service/process.h"
#include "common/base/status.h"
#include "common/files/file_descriptor.h"

namespace slabstream {

// NotFound: ffmpeg is not in $PATH; the message says what to install.
Status CheckHasMovieEncoder();

class MovieEncoder {
 public:
  // Starts ffmpeg, which waits for the first frame. `path`: the file that it is to write; empty: it writes a stream, of which output() is
  // the reading end. The calling thread must be there as long as the process (Child). Errors of CheckShape and CheckHasMovieEncoder;
  // Unavailable.
  static Result<std::unique_ptr<MovieEncoder>> Start(const MovieFormat& format, const MovieShape& shape, const std::string& path);
  ~MovieEncoder();  // ends ffmpeg if it still runs
  MovieEncoder(const MovieEncoder&) = delete;
  MovieEncoder& operator=(const MovieEncoder&) = delete;

  // A descriptor that stays this object's.
  int output() const { return encoder_.output(); }

  // Unavailable: ffmpeg ended, with the last line that it said. Cancelled: Abandon was called. Both may wait for ffmpeg, Finish for its
  // end.
  Status Put(std::span<const std::byte> frame);
  Status Finish();
  // A Put or Finish that waits for ffmpeg returns soon, with an error. Any thread.
  void Abandon();

 private:
  MovieEncoder(Child encoder, FileDescriptor frames, FileDescriptor messages);
  // Waits for ffmpeg's end; null: Abandon was called, or it goes on for longer than `patience`.
  std::optional<ChildEnd> WaitForEnd(Duration patience);
  Status Failure(const std::string& what) const;

  Child encoder_;
  const FileDescriptor frames_;    // a socket to ffmpeg's stdin: unlike a pipe it never raises SIGPIPE
  const FileDescriptor messages_;  // a file in memory, where ffmpeg's stderr goes
  std::atomic<bool> abandoned_ = false;
};

}  // namespace slabstream
