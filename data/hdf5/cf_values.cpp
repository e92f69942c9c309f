// What samples stand for by the conventions of netCDF and CF (https://cfconventions.org, chapters 2.5 and 8).
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "data/hdf5/hdf5_image.h"

namespace slabstream {
namespace {

bool SaysTrue(std::string text) {
  std::ranges::transform(text, text.begin(), [](char c) { return c >= 'A' && c <= 'Z' ? char(c - 'A' + 'a') : c; });
  return text == "true";
}

}  // namespace

std::optional<Limits> WholeNumbers(SampleType type) {
  return VisitSampleType(type, [](const auto* null) -> std::optional<Limits> {
    using T = std::remove_cvref_t<decltype(*null)>;
    if constexpr (std::is_integral_v<T>) return Limits{double(std::numeric_limits<T>::min()), double(std::numeric_limits<T>::max())};
    return std::nullopt;
  });
}

std::optional<SampleType> WithSign(SampleType type, bool has_sign) {
  const std::string name(ToString(type));
  if (!WholeNumbers(type)) return std::nullopt;
  const bool has_one = !name.starts_with('u');
  return has_one == has_sign ? type : SampleTypeNamed(has_sign ? name.substr(1) : "u" + name);
}

void DescribeValues(AttributedFile& file, const DatasetFacts& dataset, ImageDescription& image) {
  const std::string& path = dataset.path;
  ElementMeaning& meaning = image.meaning;
  std::optional<Limits> all = WholeNumbers(dataset.type);
  if (const auto text = file.Text(path, "_Unsigned"); text && all) {
    image.type = WithSign(dataset.type, !SaysTrue(*text));
    all = WholeNumbers(*image.type);
    if (image.type != dataset.type) image.notes.push_back(fmt::format("samples are {}, as _Unsigned says", ToString(*image.type)));
  }
  // A number of the dataset's type, as the type that is meant.
  const auto element = [&](double number) {
    if (!all) return number;
    const double count = all->most - all->least + 1;
    return number < all->least ? number + count : number > all->most ? number - count : number;
  };
  for (const char* const name : {"_FillValue", "missing_value"}) {
    for (const double number : file.Numbers(path, name).value_or(std::vector<double>{})) {
      const double missing = element(number);
      if (std::isnan(missing) || std::ranges::find(meaning.missing, missing) != meaning.missing.end()) continue;
      meaning.missing.push_back(missing);
      image.notes.push_back(fmt::format("samples of {:g} are NaN, as {} says", missing, name));
    }
  }
  const auto range = file.Numbers(path, "valid_range"), min = file.Numbers(path, "valid_min"), max = file.Numbers(path, "valid_max");
  const bool both = range && range->size() == 2;
  if (both || min || max) {
    if (both || min) meaning.least = element(both ? (*range)[0] : min->front());
    if (both || max) meaning.most = element(both ? (*range)[1] : max->front());
    image.notes.push_back(fmt::format("samples outside {:g} ... {:g} are NaN, as the valid range says", meaning.least, meaning.most));
    if (all && meaning.least <= all->least) meaning.least = -std::numeric_limits<double>::infinity();
    if (all && meaning.most >= all->most) meaning.most = std::numeric_limits<double>::infinity();
  }
  const auto scale = file.Numbers(path, "scale_factor"), offset = file.Numbers(path, "add_offset");
  if (scale || offset) {
    meaning.mappings = {{scale ? scale->front() : 1, offset ? offset->front() : 0}};
    image.notes.push_back(fmt::format("values are samples times {:g} plus {:g}, as scale_factor and add_offset say",
                                      meaning.mappings[0].scale, meaning.mappings[0].offset));
  }
}

}  // namespace slabstream
