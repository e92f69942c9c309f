#include "gateway/picture_requests.h"

#include <algorithm>
#include <boost/asio/post.hpp>
#include <boost/asio/thread_pool.hpp>
#include <memory>
#include <utility>

#include "client/request/picture_record.h"
#include "common/threads/guarded.h"

namespace slabstream {
namespace {

HttpReply FileReply(PictureFileType type, const Result<std::vector<std::byte>>& file, const std::string& renderer) {
  if (!file.ok()) return Failure(file.status());
  return {.type = std::string(std::ranges::find(PictureFileTypes(), type, &PictureFileTypeNames::type)->media),
          .body = std::string(reinterpret_cast<const char*>(file->data()), file->size()),
          .headers = {{"Cache-Control", "no-store"}, {"Slabstream-Renderer", renderer}}};
}

}  // namespace

void PictureRequests::MakeFile(PictureFileType type, Asked asked, std::vector<FrameRequest> frames, const PictureFormat& format,
                               EncodeFunction encode) {
  for (FrameRequest& frame : frames) {
    frame.straight8 = type == PictureFileType::kPng && HoldsStraight8(format);
    frame.straight8_over = OpaqueBackground(format);
    frame.key = format.annotations.needs_key();
  }
  if (const Status status = CheckCanDraw(format.annotations); !status.ok()) return asked.reply(Failure(status));
  under_way_.Begin(std::move(asked.reply), asked.gone, [&](const RequestsUnderWay::Finish& finish) {
    const auto done = [this, type, encode = std::move(encode), finish, trace = std::move(asked.trace), dataset = frames.front().dataset,
                       since = MonotonicNow()](Result<ServiceLink::Rendered> rendered) {
      if (!rendered.ok()) {
        if (trace != nullptr) trace->AddFailure(dataset, since, rendered.status());
        return finish([status = rendered.status()] { return Failure(status); });
      }
      if (trace != nullptr) trace->AddFrames(dataset, rendered->pictures);
      const Picture& first = rendered->pictures.front();
      metrics_.CountFrame(first.statistics, first.latency);
      // Handlers of asio are copied nowhere, but std::function would copy the pictures.
      auto held = std::make_shared<ServiceLink::Rendered>(*std::move(rendered));
      boost::asio::post(encoders_, [this, type, encode, finish, held, trace] {
        const Time begin = MonotonicNow();
        const std::string renderer = held->pictures.front().statistics.renderer;
        auto file =
            std::make_shared<const Result<std::vector<std::byte>>>(Guarded("the picture", [&] { return encode(std::move(*held)); }));
        if (file->ok()) metrics_.CountPicture("file", (*file)->size(), MonotonicNow() - begin);
        if (trace != nullptr) trace->AddEncoding(begin);
        finish([type, file, renderer] { return FileReply(type, *file, renderer); });
      });
    };
    return link_.Render(std::move(asked.asker), std::move(frames), kAnswerDeadline, {.progress = {}, .done = done});
  });
}

void PictureRequests::Render(PictureFileType type, Asked asked) {
  Result<RenderRequest> render = ParseRenderFields(asked.fields);
  if (!render.ok()) return asked.reply(Failure(render.status()));
  if (const Status status = CheckPictureSize(type, render->frame.size); !status.ok()) return asked.reply(Failure(status));
  const auto encode = [type, request = *render](const ServiceLink::Rendered& rendered) {
    const Picture& picture = rendered.pictures.front();
    const FrameRequest made = AsMade(request.frame, picture.statistics);
    const PictureNotes notes{.geometry = picture.geometry,
                             .key = picture.key,
                             .record = RecordText(made.dataset, made, request.format, picture.geometry, {}, picture.statistics.levels)};
    return PictureFile(type, picture.image, picture.size, request.format, notes);
  };
  MakeFile(type, std::move(asked), {render->frame}, render->format, encode);
}

void PictureRequests::Slice(PictureFileType type, Asked asked) {
  Result<SliceRequest> slice = ParseSliceFields(asked.fields);
  if (!slice.ok()) return asked.reply(Failure(slice.status()));
  Result<std::vector<FrameRequest>> frames = FramesOf(*slice);
  if (!frames.ok()) return asked.reply(Failure(frames.status()));
  if (const Status status = CheckPictureSize(type, slice->size()); !status.ok()) return asked.reply(Failure(status));
  const auto encode = [type, request = *slice](ServiceLink::Rendered rendered) {
    PictureNotes notes{.key = std::move(rendered.pictures.front().key)};
    std::vector<PictureImage> images;
    for (Picture& picture : rendered.pictures) {
      images.push_back(std::move(picture.image));
      notes.panes.push_back(picture.geometry);
    }
    return PictureFile(type, SideBySide(images, request.frame.size), request.size(), request.format, notes);
  };
  MakeFile(type, std::move(asked), *std::move(frames), slice->format, encode);
}

void PictureRequests::Command(const Asked& asked) {
  const Result<RenderRequest> render = ParseRenderFields(asked.fields);
  if (!render.ok()) return asked.reply(Failure(render.status()));
  if (const Status status = asked.asker.MayRead(DatasetsOf(render->frame)); !status.ok()) return asked.reply(Failure(status));
  PictureRecord record;
  record.source = render->frame.dataset;
  record.request = render->frame;
  record.format = render->format;
  asked.reply(JsonReply({{"command", CommandText(record, "picture.png")}, {"files", MapFilesOf(render->frame)}}));
}

}  // namespace slabstream
