#include "client/cli/picture_sink.h"

#include <fmt/format.h>

#include <utility>

#include "client/request/picture_record.h"
#include "common/base/check.h"

namespace slabstream {

Status PictureFiles::Put(const Picture& picture, const FrameJob& job) {
  PictureNotes notes{.geometry = picture.geometry, .key = picture.key, .record = {}};
  if (record_) {
    notes.record =
        RecordText(job.source, AsMade(job.request, picture.statistics), format_, picture.geometry, layers_, picture.statistics.levels);
  }
  return WritePicture(picture.image, picture.size, job.output, format_, notes);
}

Status CheckCanEncode(const MovieOptions& options) {
  const MovieFormat* const format = MovieFormatOf(options.path);
  CHECK(format != nullptr) << options.path;
  if (Status status = CheckShape(*format, options.shape); !status.ok()) return status;
  const Status status = CheckHasMovieEncoder();
  return status.ok() ? status : Status{status.code(), fmt::format("--output '{}': {}", options.path, status.message())};
}

Result<std::unique_ptr<Movie>> Movie::Start(const MovieOptions& options) {
  if (Status status = CheckCanEncode(options); !status.ok()) return status;
  Result<OutputFile> file = OutputFile::Create(options.path);
  if (!file.ok()) return file.status();
  Result<std::unique_ptr<MovieEncoder>> encoder = MovieEncoder::Start(*MovieFormatOf(options.path), options.shape, file->written_path());
  if (!encoder.ok()) return encoder.status();
  return std::unique_ptr<Movie>(new Movie(options, *std::move(file), *std::move(encoder)));
}

Movie::Movie(const MovieOptions& options, OutputFile file, std::unique_ptr<MovieEncoder> encoder)
    : options_(options), file_(std::move(file)), encoder_(std::move(encoder)) {}

Status Movie::OfFile(Status status) const {
  if (status.code() != StatusCode::kUnavailable) return status;
  return Status::Unavailable(fmt::format("cannot write '{}': {}", options_.path, status.message()));
}

Status Movie::Put(const Picture& picture, const FrameJob&) {
  CHECK(picture.final && picture.size == options_.shape.size);
  const Result<ComposedPicture> composed =
      ComposedPicture::Make(picture.image, picture.size, WithoutTransparency(options_.format), picture.geometry, picture.key);
  if (!composed.ok()) return composed.status();
  last_ = MovieFrame(*composed);
  return OfFile(encoder_->Put(last_));
}

Status Movie::Skip(const FrameJob&) {
  CHECK(!last_.empty());
  return OfFile(encoder_->Put(last_));
}

Status Movie::Finish() {
  if (Status status = encoder_->Finish(); !status.ok()) return OfFile(std::move(status));
  return file_.Finish();
}

}  // namespace slabstream
