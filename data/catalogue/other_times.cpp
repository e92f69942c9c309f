#include "data/catalogue/other_times.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <memory>

#include "common/base/log.h"
#include "common/text/url.h"
#include "data/open/open_source.h"
#include "data/survey/survey.h"
#include "data/volume_io/read_options.h"

namespace slabstream {
namespace {

constexpr SurveyBytes kNear = {.exact = 4 << 20, .coarse = 4 << 20}, kFar = {.exact = 1 << 20, .coarse = 1 << 20};  // of each time
constexpr std::int64_t kMostInOrder = std::int64_t{256} << 20;                                                      // bytes

Result<VolumeSummary> SurveyTime(const std::string& source, int time, const SurveyBytes& most, VolumeSource* beside) {
  Result<SourceText> text = ParseSourceText(AtTime(source, time));
  if (!text.ok()) return text.status();
  text->options.describe = true;
  const Result<std::shared_ptr<VolumeSource>> opened = OpenSource(text->path, text->options, ProcessReadContext(), beside);
  if (!opened.ok()) return opened.status();
  const Result<Survey> survey = SurveySource(**opened, most);
  return survey.ok() ? Result(*survey->summary) : survey.status();
}

}  // namespace

std::vector<VolumeSummary> SurveyOtherTimes(const std::string& source, const SourceInfo& info, VolumeSource* beside) {
  const Result<SourceText> text = ParseSourceText(source);
  const int count = info.times.count;
  if (!text.ok() || count == 1 || text->options.time || text->options.labels || info.hollow) return {};
  if (!info.in_parts() && info.finest().voxel_bytes() > kMostInOrder / count) return {};
  const bool far = !SchemeOf(text->path).empty();
  const int most = std::min(far || !info.in_parts() ? kFewOtherTimes : kMostOtherTimes, count - 1);
  std::vector<VolumeSummary> found;
  for (int i = 0; i <= most; ++i) {
    const int time = int(std::int64_t{i} * (count - 1) / most);
    if (time == info.time || int(found.size()) == most) continue;
    Result<VolumeSummary> summary = SurveyTime(source, time, far ? kFar : kNear, beside);
    if (summary.ok()) {
      found.push_back(*std::move(summary));
    } else {
      LogWarning(fmt::format("{}: statistics leave out time {}: {}", source, time, summary.status().message()));
    }
  }
  return found;
}

}  // namespace slabstream
