// PictureFiles: each picture becomes the file that its job names.
#pragma once

#include <utility>

#include "client/cli/picture_sink.h"
#include "client/pictures/picture_writer.h"
#include "data/layers/layer_files.h"

namespace slabstream {

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

}  // namespace slabstream
