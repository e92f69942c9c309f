// Where the finished pictures of a sequence of frames go: each into a file of its own (PictureFiles), or all into a movie (Movie).
#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "client/client.h"
#include "client/movie/movie_encoder.h"
#include "client/movie/movie_format.h"
#include "client/pictures/picture_writer.h"
#include "common/base/status.h"
#include "common/files/files.h"
#include "common/frame/frame_request.h"
#include "data/layers/layer_files.h"

namespace slabstream {

// One of a sequence of frames.
struct FrameJob {
  FrameRequest request;
  std::string output;  // the file that the picture goes into; empty: none
  std::string source;  // SOURCE as it was typed, for records of pictures
};

// RenderFrames calls Put from threads of its own, and Finish after the last Put has returned.
class PictureSink {
 public:
  virtual ~PictureSink() = default;

  // Whether pictures come one after the other, in the order of their jobs. Else several may come at a time, in any order, and previews too.
  virtual bool in_order() const = 0;
  // Sets FrameRequest::straight8 and straight8_over as they suit the picture of this job. Any thread.
  virtual void ChooseCodes(const FrameJob& job, FrameRequest& request) const = 0;
  virtual Status Put(const Picture& picture, const FrameJob& job) = 0;
  // Instead of Put: this frame has failed. Never the first one in order.
  virtual Status Skip(const FrameJob& job) = 0;
  virtual Status Finish() = 0;
  // No picture will come any more. A Put or Finish that waits for somebody else returns soon, with an error. Any thread.
  virtual void Abandon() = 0;
};

// Each picture becomes the file that its job names.
class PictureFiles : public PictureSink {
 public:
  // `record`: the files say how they were made (picture_record.h), with these files of layers.
  PictureFiles(const PictureFormat& format, bool record, LayerFiles layers)
      : format_(format), record_(record), layers_(std::move(layers)) {}

  bool in_order() const override { return false; }
  void ChooseCodes(const FrameJob& job, FrameRequest& request) const override {
    request.straight8 = FileHoldsStraight8(job.output, format_);
    request.straight8_over = OpaqueBackground(format_);
  }
  Status Put(const Picture& picture, const FrameJob& job) override;
  Status Skip(const FrameJob&) override { return Status::Ok(); }
  Status Finish() override { return Status::Ok(); }
  void Abandon() override {}  // files wait for nobody

 private:
  const PictureFormat format_;
  const bool record_;
  const LayerFiles layers_;
};

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
