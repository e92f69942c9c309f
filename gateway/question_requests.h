// Requests for what datasets hold. All calls on the io thread.
#pragma once

#include <string>
#include <string_view>

#include "client/request/picture_fields.h"
#include "common/json/json.h"
#include "gateway/request_fields.h"
#include "gateway/requests_under_way.h"

namespace slabstream {

class QuestionRequests {
 public:
  // All must outlive this.
  QuestionRequests(boost::asio::io_context& io, Metrics& metrics, ServiceLink& link);

  void Histogram(PictureFields fields, ReplyFunction reply, const Gone& gone);
  void JointHistogram(PictureFields fields, ReplyFunction reply, const Gone& gone);
  void Labels(PictureFields fields, ReplyFunction reply, const Gone& gone);
  void Value(PictureFields fields, ReplyFunction reply, const Gone& gone);
  void Profile(PictureFields fields, ReplyFunction reply, const Gone& gone);
  void Statistics(PictureFields fields, ReplyFunction reply, const Gone& gone);
  void Pick(PictureFields fields, ReplyFunction reply, const Gone& gone);
  void Transfer(const PictureFields& fields, ReplyFunction reply, const Gone& gone);
  void Parameters(PictureFields fields, bool post, ReplyFunction reply, const Gone& gone);  // only a POST changes any

 private:
  using MakeFunction = std::function<HttpReply(const ServiceLink::Answer&)>;
  // Replies with the mistake of `read` if there is one.
  void Ask(std::string_view name, const FieldReader& read, ServiceLink::Inquiry question, const MakeFunction& make, ReplyFunction reply,
           const Gone& gone);
  // A question about a dataset alone, whose answer becomes JSON.
  template <class Query, class Reply>
  void AskOfDataset(std::string_view name, Json (*json)(const std::string&, const Reply&), PictureFields fields, ReplyFunction reply,
                    const Gone& gone);

  Metrics& metrics_;
  ServiceLink& link_;
  RequestsUnderWay under_way_;
};

}  // namespace slabstream
