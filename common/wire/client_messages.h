// The client plane: coordinator (ROUTER) and clients (DEALER).
//
//   client                                  coordinator
//   SubmitFrame -------------------------->            a request id that the client chose; sent again it changes nothing
//               <--------------------------  FrameProgress          whenever something happens
//               <--------------------------  FrameReply + payload   per group if previews were asked for; the last one ends the request
//               <--------------------------  FrameFailed            ends the request
//   CancelFrame -------------------------->            ends the request; answered by FrameFailed (cancelled)
//   ClientPing  -------------------------->            every second while requests are open; silence of client_timeout frees them
//               <--------------------------  ClientPong             which of them are still known
//   StatusQuery -------------------------->  StatusReply
//   ShutDown    -------------------------->  ShutDownReply          the service and its workers end
//   KeysOrder   -------------------------->  KeysReply
//   DataOrder   -------------------------->  DataReply
//   Any of the last three may be answered by OrderRefused: over encrypted connections they need an admin's key, but for lists of datasets.
//   SteerDataset ------------------------>  SteerReply, or OrderRefused
//   SummaryQuery ------------------------>  SummaryReply
//   SampleQuery ------------------------->  SampleReply
//   StatisticsQuery --------------------->  StatisticsReply
//   JointHistogramQuery ----------------->  JointHistogramReply
//   PickQuery --------------------------->  PickReply
//   ViewQuery --------------------------->  ViewReply
//   These questions wait until their dataset is loaded and its files were looked at, as frames do. Any of them may be answered by
//   OrderRefused.
//
// A client also sends datasets that are no files of the coordinator's host:
//   AddVolume   -------------------------->            admits it, or OrderRefused, which ends it at any time
//               <--------------------------  VolumeCredit           as it takes more
//   VolumePart + payload ----------------->            in order, within the credit
//               <--------------------------  DataReply              it is in the catalogue
//   DropVolume  -------------------------->            answered by OrderRefused (cancelled)
// A client sends one at a time: a new AddVolume ends the one before. If the client falls silent meanwhile, nothing stays. The dataset of a
// file (SentFile) lasts as long as its client: until a DropVolume of the same nonce, or until the client falls silent.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <variant>

#include "common/base/merged.h"
#include "common/wire/client_structs.h"
#include "common/wire/ids.h"
#include "common/wire/picture_messages.h"

namespace slabstream {

inline constexpr std::size_t kMaxOpenRequests = 256;       // open requests of one client
inline constexpr std::int64_t kMaxRequestBytes = 1 << 20;  // limit of the coordinator's client socket; any header that a client sends fits
inline constexpr std::size_t kMaxDataItems = 128;          // items of one order
inline constexpr std::size_t kMaxDataItemBytes = 5120;     // a name, a path and what may stand between and behind them
inline constexpr std::size_t kMaxOpenQuestions = 64;       // open questions of one client
inline constexpr std::size_t kMaxSamplePoints = 4096;
inline constexpr std::size_t kMaxPercentiles = 64;
inline constexpr std::uint32_t kMaxVolumePartBytes = std::uint32_t{1} << 19;
inline constexpr std::uint64_t kMaxSentFileBytes = std::uint64_t{1} << 40;

inline RefusedRequests& operator+=(RefusedRequests& refused, const RefusedRequests& more) {
  return refused = {refused.bad_request + more.bad_request, refused.unknown_dataset + more.unknown_dataset,
                    refused.too_large + more.too_large, refused.over_quota + more.over_quota};
}

// Bytes of the file, or of the samples of the volume, its labels and its overlay.
inline std::uint64_t BytesToSend(const AddVolume& order) {
  if (order.file) return order.file->bytes;
  const std::size_t of_voxel =
      BytesPerSample(order.description.type) + order.label_bytes + (order.overlay ? BytesPerSample(ScalarType::kFloat32) : 0);
  return std::uint64_t(order.description.geometry.bounds().voxel_count()) * of_voxel;
}

using ClientToFrames = std::variant<SubmitFrame, CancelFrame, ClientPing, StatusQuery, ShutDown>;  // and about the service
using ClientToDatasets = std::variant<DataOrder, SummaryQuery, SampleQuery, StatisticsQuery, JointHistogramQuery, PickQuery, ViewQuery,
                                      AddVolume, VolumePart, DropVolume>;
using ClientToCoordinator = Merged<ClientToFrames, ClientToDatasets, std::variant<KeysOrder, SteerDataset>>;
using CoordinatorToClient =
    std::variant<FrameProgress, FrameReply, FrameFailed, ClientPong, StatusReply, ShutDownReply, KeysReply, DataReply, OrderRefused,
                 SummaryReply, SampleReply, StatisticsReply, JointHistogramReply, PickReply, ViewReply, VolumeCredit, SteerReply>;

using Question = std::variant<SummaryQuery, SampleQuery, StatisticsQuery, JointHistogramQuery, PickQuery, ViewQuery>;
using QuestionReply = std::variant<SummaryReply, SampleReply, StatisticsReply, JointHistogramReply, PickReply, ViewReply>;
template <class Query>
const std::string& DatasetOf(const Query& query) {
  if constexpr (requires { query.dataset; }) {
    return query.dataset;
  } else {
    return query.frame.dataset;
  }
}
// A request for a picture that shows what the question is about.
inline FrameRequest PictureOf(const Question& question) {
  return std::visit(
      []<class Query>(const Query& query) {
        if constexpr (requires { query.frame; }) {
          return query.frame;
        } else {
          FrameRequest picture{.dataset = query.dataset};
          if constexpr (requires { query.channels; }) {
            picture.channels = query.channels;
          } else if (!query.field.empty()) {
            picture.channels = {query.field};
          }
          picture.time = query.time;
          return picture;
        }
      },
      question);
}
// About what a picture's colours mean: the first channel that it names, at its time, with its transfer function.
inline SummaryQuery SummaryOf(const FrameRequest& picture) {
  return {.dataset = picture.dataset,
          .transfer = picture.transfer,
          .field = picture.channels.empty() ? "" : picture.channels.front(),
          .time = picture.time,
          .looks = picture.fields,
          .flat = picture.clipping.slab.has_value()};
}
inline const std::string& DatasetOf(const Question& question) {
  return std::visit([](const auto& query) -> const std::string& { return DatasetOf(query); }, question);
}
inline std::uint64_t NonceOf(const Question& question) {
  return std::visit([](const auto& query) { return query.nonce; }, question);
}

}  // namespace slabstream
