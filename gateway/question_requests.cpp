#include "gateway/question_requests.h"

#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <utility>
#include <variant>

#include "client/report/dataset_text.h"
#include "client/report/volume_text.h"
#include "client/request/values.h"
#include "common/base/printable.h"
#include "common/classification/transfer_function.h"
#include "common/cli/parse.h"
#include "common/math/points_along.h"
#include "gateway/openapi.h"

namespace slabstream {
namespace {

constexpr int kMaxQuestions = 32;  // under way: fewer than a client may have
static_assert(kMaxQuestions < int(kMaxOpenQuestions));

// Which channel of the dataset, or of points which channels, and which time.
template <class Query>
Query About(FieldReader& read, Query query) {
  const std::string field = read.Get("field", "");
  query.time = read.Get("time", "");
  for (const std::string& text : {field, query.time}) {
    if (text.size() > kMaxNameBytes)
      read.Refuse(fmt::format("field or time has {} bytes, at most {} are possible", text.size(), kMaxNameBytes));
  }
  if constexpr (requires { query.field; }) {
    query.field = field;
  } else if (!field.empty()) {
    query.channels = read.Value(ParseNames("field", field));
  }
  return query;
}

// The same of a question that has no fields but these and the dataset.
template <class Query>
Query AboutAlone(FieldReader& read, Query query) {
  query = About(read, std::move(query));
  query.dataset = read.Dataset();
  return query;
}

}  // namespace

QuestionRequests::QuestionRequests(boost::asio::io_context& io, Metrics& metrics, ServiceLink& link)
    : metrics_(metrics), link_(link), under_way_(io, metrics, link, "questions", kMaxQuestions) {}

void QuestionRequests::Ask(std::string_view name, const FieldReader& read, Asked asked, ServiceLink::Inquiry question,
                           const MakeFunction& make) {
  if (!read.status().ok()) return asked.reply(Failure(read.status()));
  under_way_.Begin(std::move(asked.reply), asked.gone, [&](const RequestsUnderWay::Finish& finish) {
    const auto done = [this, name, make, finish, begin = MonotonicNow()](Result<ServiceLink::Answer> answer) {
      finish([this, name, make, begin, held = std::make_shared<const Result<ServiceLink::Answer>>(std::move(answer))] {
        if (!held->ok()) return Failure(held->status());
        metrics_.CountAnswer(name, MonotonicNow() - begin);
        HttpReply made = make(**held);
        made.headers.emplace_back("Cache-Control", "no-store");
        return made;
      });
    };
    return link_.Ask(std::move(asked.asker), std::move(question), kAnswerDeadline, done);
  });
}

template <class Query, class Reply>
void QuestionRequests::AskOfDataset(std::string_view name, Json (*json)(const std::string&, const Reply&), Asked asked) {
  FieldReader read(std::move(asked.fields));
  Query query = AboutAlone(read, Query());
  const auto make = [json, dataset = query.dataset](const ServiceLink::Answer& answer) {
    return JsonReply(json(dataset, std::get<Reply>(answer)));
  };
  Ask(name, read, std::move(asked), std::move(query), make);
}

void QuestionRequests::Histogram(Asked asked) { AskOfDataset<SummaryQuery>("histogram", HistogramJson, std::move(asked)); }
void QuestionRequests::Labels(Asked asked) { AskOfDataset<SummaryQuery>("labels", LabelsJson, std::move(asked)); }
void QuestionRequests::JointHistogram(Asked asked) {
  AskOfDataset<JointHistogramQuery>("joint-histogram", JointHistogramJson, std::move(asked));
}

void QuestionRequests::Value(Asked asked) {
  FieldReader read(std::move(asked.fields));
  const Vec3 point = read.Value(ParsePoint("at", read.Need("at", kPointHelp)));
  const auto make = [](const ServiceLink::Answer& answer) { return JsonReply(SampleJson(std::get<SampleReply>(answer).samples.at(0))); };
  Ask("value", read, std::move(asked), AboutAlone(read, SampleQuery{.points = {point}}), make);
}

void QuestionRequests::Profile(Asked asked) {
  FieldReader read(std::move(asked.fields));
  const std::string from_text = read.Need("from", kLineHelp), to_text = read.Need("to", kLineHelp);
  const Vec3 from = read.Value(ParsePoint("from", from_text)), to = read.Value(ParsePoint("to", to_text));
  const std::string samples_text = read.Get("samples", std::to_string(kProfileSamples));
  const int samples = std::max(read.Value(ParseInteger("samples", samples_text, 2, int(kMaxSamplePoints))), 2);
  const auto make = [](const ServiceLink::Answer& answer) { return JsonReply(ProfileJson(std::get<SampleReply>(answer).samples)); };
  Ask("profile", read, std::move(asked), AboutAlone(read, SampleQuery{.points = PointsAlong(from, to, samples)}), make);
}

void QuestionRequests::Statistics(Asked asked) {
  FieldReader read(std::move(asked.fields));
  const ClipBox box = read.Value(ParseClipBox("box", read.Get("box", kWholeBox)));
  const std::string labels = read.Get("labels", "false"), format = read.Get("format", "json");
  const bool by_label = labels == "true" || labels.empty(), csv = format == "csv";
  if (!by_label && labels != "false") {
    read.Refuse(fmt::format("labels '{}' is neither true nor false", Printable(labels.substr(0, 64))));
  }
  if (!csv && format != "json") read.Refuse(fmt::format("format '{}' is not one of json, csv", Printable(format.substr(0, 64))));
  if (csv && !by_label) read.Refuse("format 'csv' is the table of labels: it needs labels=true");
  const auto make = [by_label, csv](const ServiceLink::Answer& answer) {
    const auto& found = std::get<StatisticsReply>(answer);
    if (csv) return HttpReply{.type = "text/csv; charset=utf-8", .body = LabelStatisticsCsv(found), .headers = {}};
    return JsonReply(by_label ? LabelStatisticsJson(found) : BoxStatisticsJson(found.statistics));
  };
  Ask("statistics", read, std::move(asked), AboutAlone(read, StatisticsQuery{.box = box, .labels = by_label}), make);
}

void QuestionRequests::Pick(Asked asked) {
  FieldReader read(std::move(asked.fields));
  const std::string x_text = read.Need("x", kPixelXHelp), y_text = read.Need("y", kPixelYHelp);
  const RenderRequest render = read.Value(ParseRenderFields(read.rest()));
  const double x = read.Value(ParseNumber("x", x_text, {0, double(render.frame.size.width)}));
  const double y = read.Value(ParseNumber("y", y_text, {0, double(render.frame.size.height)}));
  const auto make = [frame = render.frame](const ServiceLink::Answer& answer) {
    return JsonReply(PickJson(std::get<PickReply>(answer), frame));
  };
  Ask("pick", read, std::move(asked), PickQuery{.frame = render.frame, .x = x, .y = y}, make);
}

void QuestionRequests::Transfer(Asked asked) {
  FieldReader read(std::move(asked.fields));
  SummaryQuery query = About(read, SummaryQuery());
  for (const PictureField& field : read.rest()) {
    if (field.name != "dataset" && field.name != "transfer" && field.name != "scalar-range") {
      read.Refuse(fmt::format("there is no option '{}': dataset, transfer, scalar-range, field and time are taken",
                              Printable(field.name).substr(0, 128)));
    }
  }
  const FrameRequest frame = read.Value(ParseRenderFields(read.rest())).frame;
  query.dataset = frame.dataset;
  query.transfer = frame.transfer;
  const auto* preset = std::get_if<std::string>(&frame.transfer.choice);
  const auto make = [name = preset != nullptr ? *preset : "function"](const ServiceLink::Answer& answer) {
    return HttpReply{.body = FormatParaViewColorMap(std::get<SummaryReply>(answer).transfer, name)};
  };
  Ask("transfer", read, std::move(asked), std::move(query), make);
}

void QuestionRequests::Parameters(Asked asked) {
  FieldReader read(std::move(asked.fields));
  SteerDataset order;
  if (read.Has("set")) {
    if (!asked.post) return asked.reply(Failure(405, "parameters are set by POST"));
    order.values = read.Value(ParseSteeredValues("set", read.Need("set", "")));
  }
  order.dataset = read.Dataset();
  const auto make = [](const ServiceLink::Answer& answer) { return JsonReply(SimulationJson(std::get<SteerReply>(answer).simulation)); };
  Ask("parameters", read, std::move(asked), std::move(order), make);
}

}  // namespace slabstream
