// Movie: where the frames of a sequence go that become one movie in a file.
#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include "client/cli/picture_sink.h"
#include "client/movie/movie_encoder.h"
#include "client/movie/movie_format.h"
#include "client/pictures/picture_writer.h"
#include "common/base/status.h"
#include "common/files/files.h"

namespace slabstream {

struct MovieOptions {
  std::string path;  // the movie's path, as MovieFormatOf has it
  MovieShape shape;
  PictureFormat format;  // black shows through a transparent background
};

// For a message before the work begins. Errors of CheckShape and CheckHasMovieEncoder.
Status CheckCanEncode(const MovieOptions& options);

// The file appears, and takes the place of an older one, when Finish has succeeded; else nothing is left of it.
//
// Errors are Unavailable and name the path: ffmpeg ended, with the last line that it said, or the file cannot be written.
class Movie : public PictureSink {
 public:
  // As MovieEncoder::Start. Errors of CheckCanEncode too.
  static Result<std::unique_ptr<Movie>> Start(const MovieOptions& options);

  bool in_order() const override { return true; }
  void ChooseCodes(const FrameJob&, FrameRequest& request) const override { request.straight8 = false; }
  Status Put(const Picture& picture, const FrameJob& job) override;
  Status Skip(const FrameJob& job) override;  // shows the frame before it in its place
  Status Finish() override;
  void Abandon() override { encoder_->Abandon(); }

 private:
  Movie(const MovieOptions& options, OutputFile file, std::unique_ptr<MovieEncoder> encoder);
  Status OfFile(Status status) const;

  const MovieOptions options_;
  OutputFile file_;
  const std::unique_ptr<MovieEncoder> encoder_;
  std::vector<std::byte> last_;  // the frame that was put last
};

}  // namespace slabstream
