// Files that pages send, which become datasets of the service. All calls on the io thread.
//
//   POST upload?file=NAME&bytes=N          begins one: {"upload": ID, "dataset": NAME}
//   POST upload?upload=ID&begin=B + body   the next bytes: {"received": N}, once the service takes them; with the last ones, once the
//                                          dataset is there
//   POST upload?upload=ID&drop=true        removes it
// A dataset of a file goes when the gateway ends, or when nobody has looked at it for kUnseen. A file of which no part comes for kStalled
// is given up.
#pragma once

#include <boost/asio/io_context.hpp>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "client/client.h"
#include "client/file_upload.h"
#include "client/request/picture_fields.h"
#include "common/base/time.h"
#include "gateway/metrics.h"
#include "gateway/requests_under_way.h"

namespace slabstream {

inline constexpr std::size_t kMaxUploadsKept = 16;
inline constexpr Duration kUnseen = std::chrono::minutes(10);
inline constexpr Duration kStalled = std::chrono::minutes(1);  // between the parts of a file: the service takes few files at a time
// The most bytes of a file, unless the gateway is told another limit.
inline constexpr std::uint64_t kUploadBytes = std::uint64_t{1} << 30;

// The name of a file that a browser tells, as the service takes it: with the file's ending.
std::string FileNameForService(std::string_view name);

class Uploads {
 public:
  // All must outlive this. `most_bytes`: of a file; 0: none are taken.
  Uploads(boost::asio::io_context& io, Context& context, ServiceAddress service, Metrics& metrics, std::uint64_t most_bytes)
      : io_(io), context_(context), service_(std::move(service)), metrics_(metrics), most_bytes_(most_bytes) {}

  // `taken`: names of the service's datasets.
  void Handle(Asked asked, const std::vector<std::string>& taken);
  // A page or a request shows the dataset, which may be any.
  void Touch(std::string_view dataset, Time now);
  void RemoveUnseen(Time now);
  void Stop() { uploads_.clear(); }  // removes all

 private:
  struct Upload {
    std::string dataset;
    // The file's size; bytes that have come; bytes that have gone on to the service.
    std::uint64_t bytes = 0, received = 0, sent = 0;
    bool there = false;             // the dataset
    std::optional<Status> failure;  // nobody has been told yet
    ReplyFunction waiting;          // for the end of the last part; empty: nobody waits
    std::uint64_t requests = 0;     // with parts
    Time used;
    std::unique_ptr<FileUpload> sender;
  };
  using Place = std::map<std::string, Upload>::iterator;  // by ID

  void Begin(FieldReader read, const std::vector<std::string>& taken, const ReplyFunction& reply);
  void Continue(Place upload, std::uint64_t begin, std::string body, ReplyFunction reply, const Gone& gone);
  void OnSent(const std::string& id, std::uint64_t bytes);
  void OnChanged(const std::string& id, const Status& status);
  void AnswerIfDone(Upload& upload);

  boost::asio::io_context& io_;
  Context& context_;
  const ServiceAddress service_;
  Metrics& metrics_;
  const std::uint64_t most_bytes_;
  std::map<std::string, Upload> uploads_;
  const std::shared_ptr<bool> alive_ = std::make_shared<bool>(true);
};

}  // namespace slabstream
