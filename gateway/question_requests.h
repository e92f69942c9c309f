// Requests for what datasets hold. All calls on the io thread.
#pragma once

#include <string>
#include <string_view>

#include "client/request/picture_fields.h"
#include "common/json/json.h"
#include "gateway/requests_under_way.h"

namespace slabstream {

class QuestionRequests {
 public:
  // All must outlive this.
  QuestionRequests(boost::asio::io_context& io, Metrics& metrics, ServiceLink& link);

  void Histogram(Asked asked);
  void JointHistogram(Asked asked);
  void Labels(Asked asked);
  void Value(Asked asked);
  void Profile(Asked asked);
  void Statistics(Asked asked);
  void Pick(Asked asked);
  void Transfer(Asked asked);
  void Parameters(Asked asked);  // only a POST changes any

 private:
  using MakeFunction = std::function<HttpReply(const ServiceLink::Answer&)>;
  // Replies with the mistake of `read` if there is one.
  void Ask(std::string_view name, const FieldReader& read, Asked asked, ServiceLink::Inquiry question, const MakeFunction& make);
  // A question about a dataset alone, whose answer becomes JSON.
  template <class Query, class Reply>
  void AskOfDataset(std::string_view name, Json (*json)(const std::string&, const Reply&), Asked asked);

  Metrics& metrics_;
  ServiceLink& link_;
  RequestsUnderWay under_way_;
};

}  // namespace slabstream
