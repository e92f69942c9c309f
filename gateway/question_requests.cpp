#include "gateway/question_requests.h"

#include <fmt/format.h>

#include <memory>
#include <string>
#include <utility>
#include <variant>

#include "client/report/volume_text.h"
#include "client/request/values.h"
#include "common/base/printable.h"
#include "common/classification/transfer_function.h"
#include "common/cli/parse.h"
#include "common/math/points_along.h"
#include "gateway/openapi.h"
#include "gateway/request_fields.h"

namespace slabstream {
namespace {

constexpr int kMaxQuestions = 32;  // under way: fewer than a client may have
static_assert(kMaxQuestions < int(kMaxOpenQuestions));

}  // namespace

QuestionRequests::QuestionRequests(boost::asio::io_context& io, Metrics& metrics, ServiceLink& link)
    : metrics_(metrics), link_(link), under_way_(io, metrics, link, "questions", kMaxQuestions) {}

void QuestionRequests::Ask(std::string_view name, Question question, const MakeFunction& make, ReplyFunction reply, const Gone& gone) {
  under_way_.Begin(std::move(reply), gone, [&](const RequestsUnderWay::Finish& finish) {
    const auto done = [this, name, make, finish, begin = MonotonicNow()](Result<QuestionReply> answer) {
      finish([this, name, make, begin, held = std::make_shared<const Result<QuestionReply>>(std::move(answer))] {
        if (!held->ok()) return Failure(held->status());
        metrics_.CountAnswer(name, MonotonicNow() - begin);
        HttpReply made = make(**held);
        made.headers.emplace_back("Cache-Control", "no-store");
        return made;
      });
    };
    return link_.Ask(std::move(question), kAnswerDeadline, done);
  });
}

void QuestionRequests::Histogram(PictureFields fields, ReplyFunction reply, const Gone& gone) {
  Result<std::string> dataset = OnlyDataset(std::move(fields));
  if (!dataset.ok()) return reply(Failure(dataset.status()));
  const auto make = [name = *dataset](const QuestionReply& answer) {
    return JsonReply(HistogramJson(name, std::get<SummaryReply>(answer)));
  };
  Ask("histogram", SummaryQuery{.dataset = *dataset, .transfer = {}}, make, std::move(reply), gone);
}

void QuestionRequests::JointHistogram(PictureFields fields, ReplyFunction reply, const Gone& gone) {
  Result<std::string> dataset = OnlyDataset(std::move(fields));
  if (!dataset.ok()) return reply(Failure(dataset.status()));
  const auto make = [name = *dataset](const QuestionReply& answer) {
    return JsonReply(JointHistogramJson(name, std::get<JointHistogramReply>(answer)));
  };
  Ask("joint-histogram", JointHistogramQuery{.dataset = *dataset}, make, std::move(reply), gone);
}

void QuestionRequests::Labels(PictureFields fields, ReplyFunction reply, const Gone& gone) {
  Result<std::string> dataset = OnlyDataset(std::move(fields));
  if (!dataset.ok()) return reply(Failure(dataset.status()));
  const auto make = [name = *dataset](const QuestionReply& answer) { return JsonReply(LabelsJson(name, std::get<SummaryReply>(answer))); };
  Ask("labels", SummaryQuery{.dataset = *dataset, .transfer = {}}, make, std::move(reply), gone);
}

void QuestionRequests::Value(PictureFields fields, ReplyFunction reply, const Gone& gone) {
  const Result<std::string> at = Take(fields, "at", kPointHelp);
  if (!at.ok()) return reply(Failure(at.status()));
  const Result<Vec3> point = ParsePoint("at", *at);
  if (!point.ok()) return reply(Failure(Printable(point.status())));
  const Result<std::string> dataset = OnlyDataset(std::move(fields));
  if (!dataset.ok()) return reply(Failure(dataset.status()));
  const auto make = [](const QuestionReply& answer) { return JsonReply(SampleJson(std::get<SampleReply>(answer).samples.at(0))); };
  Ask("value", SampleQuery{.dataset = *dataset, .points = {*point}}, make, std::move(reply), gone);
}

void QuestionRequests::Profile(PictureFields fields, ReplyFunction reply, const Gone& gone) {
  const Result<std::string> from_text = Take(fields, "from", kLineHelp), to_text = Take(fields, "to", kLineHelp),
                            samples_text = TakeOr(fields, "samples", std::to_string(kProfileSamples));
  for (const Result<std::string>* text : {&from_text, &to_text, &samples_text}) {
    if (!text->ok()) return reply(Failure(text->status()));
  }
  const Result<Vec3> from = ParsePoint("from", *from_text), to = ParsePoint("to", *to_text);
  for (const Result<Vec3>* point : {&from, &to}) {
    if (!point->ok()) return reply(Failure(Printable(point->status())));
  }
  const Result<int> samples = ParseInteger("samples", *samples_text, 2, int(kMaxSamplePoints));
  if (!samples.ok()) return reply(Failure(Printable(samples.status())));
  const Result<std::string> dataset = OnlyDataset(std::move(fields));
  if (!dataset.ok()) return reply(Failure(dataset.status()));
  const auto make = [](const QuestionReply& answer) { return JsonReply(ProfileJson(std::get<SampleReply>(answer).samples)); };
  Ask("profile", SampleQuery{.dataset = *dataset, .points = PointsAlong(*from, *to, *samples)}, make, std::move(reply), gone);
}

void QuestionRequests::Statistics(PictureFields fields, ReplyFunction reply, const Gone& gone) {
  const Result<std::string> text = TakeOr(fields, "box", kWholeBox), labels = TakeOr(fields, "labels", "false"),
                            format = TakeOr(fields, "format", "json");
  for (const Result<std::string>* each : {&text, &labels, &format}) {
    if (!each->ok()) return reply(Failure(each->status()));
  }
  const Result<ClipBox> box = ParseClipBox("box", *text);
  if (!box.ok()) return reply(Failure(Printable(box.status())));
  const bool by_label = *labels == "true" || labels->empty();
  if (!by_label && *labels != "false")
    return reply(Failure(400, fmt::format("labels '{}' is neither true nor false", Printable(labels->substr(0, 64)))));
  if (*format != "json" && *format != "csv")
    return reply(Failure(400, fmt::format("format '{}' is not one of json, csv", Printable(format->substr(0, 64)))));
  if (*format == "csv" && !by_label) return reply(Failure(400, "format 'csv' is the table of labels: it needs labels=true"));
  const Result<std::string> dataset = OnlyDataset(std::move(fields));
  if (!dataset.ok()) return reply(Failure(dataset.status()));
  const auto make = [by_label, csv = *format == "csv"](const QuestionReply& answer) {
    const auto& found = std::get<StatisticsReply>(answer);
    if (csv) return HttpReply{.type = "text/csv; charset=utf-8", .body = LabelStatisticsCsv(found), .headers = {}};
    return JsonReply(by_label ? LabelStatisticsJson(found) : BoxStatisticsJson(found.statistics));
  };
  Ask("statistics", StatisticsQuery{.dataset = *dataset, .box = *box, .labels = by_label}, make, std::move(reply), gone);
}

void QuestionRequests::Pick(PictureFields fields, ReplyFunction reply, const Gone& gone) {
  const Result<std::string> x_text = Take(fields, "x", kPixelXHelp), y_text = Take(fields, "y", kPixelYHelp);
  for (const Result<std::string>* text : {&x_text, &y_text}) {
    if (!text->ok()) return reply(Failure(text->status()));
  }
  const Result<RenderRequest> render = ParseRenderFields(fields);
  if (!render.ok()) return reply(Failure(render.status()));
  const Result<double> x = ParseNumber("x", *x_text, {0, double(render->frame.size.width)});
  const Result<double> y = ParseNumber("y", *y_text, {0, double(render->frame.size.height)});
  for (const Result<double>* number : {&x, &y}) {
    if (!number->ok()) return reply(Failure(Printable(number->status())));
  }
  const auto make = [](const QuestionReply& answer) { return JsonReply(PickJson(std::get<PickReply>(answer))); };
  Ask("pick", PickQuery{.frame = render->frame, .x = *x, .y = *y}, make, std::move(reply), gone);
}

void QuestionRequests::Transfer(const PictureFields& fields, ReplyFunction reply, const Gone& gone) {
  for (const PictureField& field : fields) {
    if (field.name != "dataset" && field.name != "transfer" && field.name != "scalar-range") {
      return reply(Failure(
          400, fmt::format("there is no option '{}': dataset, transfer and scalar-range are taken", Printable(field.name).substr(0, 128))));
    }
  }
  const Result<RenderRequest> render = ParseRenderFields(fields);
  if (!render.ok()) return reply(Failure(render.status()));
  const auto* preset = std::get_if<std::string>(&render->frame.transfer.choice);
  const auto make = [name = preset != nullptr ? *preset : "function"](const QuestionReply& answer) {
    return HttpReply{.body = FormatParaViewColorMap(std::get<SummaryReply>(answer).transfer, name)};
  };
  Ask("transfer", SummaryQuery{.dataset = render->frame.dataset, .transfer = render->frame.transfer}, make, std::move(reply), gone);
}

}  // namespace slabstream
