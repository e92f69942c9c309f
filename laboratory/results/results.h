// Results: what an experiment found, one value a row (tidy data: Wickham, 2014). A folder gets them twice, as results.jsonl (an object a
// line, columns that do not apply left out) and results.csv (all columns). docs/reference/results.md defines columns and metrics.
//
// One thread at a time.
#pragma once

#include <cstdint>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "common/base/status.h"
#include "common/json/json.h"
#include "laboratory/measure/statistics.h"

namespace slabstream {

// The columns and metrics: the only list of each. python/slabstream_lab reads what is written with them. Names stay; a column that changes
// its meaning gets a new name and results a new kResultsVersion.
inline constexpr int kResultsVersion = 1;

struct Column {
  std::string_view name, meaning;
};
// What a value was found for. A case leaves out the columns that do not apply to it.
std::span<const Column> CaseColumns();
// Around them: which run, the value itself, and who found it.
std::span<const Column> RunColumns();
std::span<const Column> ValueColumns();

struct Metric {
  std::string_view name, unit, meaning;
};
std::span<const Metric> Metrics();

// The source of a number.
enum class Origin : std::uint8_t {
  kMeasured = 0,   // on this machine, by running it
  kSimulated = 1,  // in virtual time, from costs measured on this machine
  kPaper = 2,      // printed by Yagel and Machiraju
};

// "measured", "simulated", "paper".
std::string_view ToString(Origin origin);

// Who found the values of a run.
struct FoundBy {
  std::string experiment, commit, machine;
};

class Results {
 public:
  explicit Results(FoundBy by) : by_(std::move(by)) {}

  // `of`: an object whose names are in CaseColumns(). `metric`: a name of Metrics(), and the value in its unit. CHECKs both, and that no
  // value was added before for the same case, metric and origin. A value that is not finite is left out.
  // `each`: the repeats in their order; none, if they cannot be told.
  void Add(const Json& of, std::string_view metric, const Estimate& value, Origin origin, const std::vector<double>& each = {});
  void Add(const Json& of, std::string_view metric, const std::vector<double>& each, Origin origin) {
    Add(of, metric, MedianOf(each), origin, each);
  }
  void Add(const Json& of, std::string_view metric, double value, Origin origin) {
    Add(of, metric, Estimate{value, value, value, 1, 0}, origin);
  }

  // A table that is not tidy data, such as the spans of a timeline: FOLDER/NAME.csv. `rows`: objects with the same names.
  void Attach(std::string name, std::vector<Json> rows) { attached_.emplace_back(std::move(name), std::move(rows)); }

  const std::vector<Json>& rows() const { return rows_; }
  Status Write(const std::string& folder) const;

 private:
  FoundBy by_;
  std::vector<Json> rows_;  // the rows of results.jsonl
  std::set<std::string> known_;
  std::vector<std::pair<std::string, std::vector<Json>>> attached_;
};

}  // namespace slabstream
