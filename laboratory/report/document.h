// Report: the result of an experiment, structured like a good lab report: question, method, answer in one sentence with its number, then
// the plots and tables that show it. A value; WriteReport writes it as one HTML page and as files for programs.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <variant>
#include <vector>

#include "common/base/status.h"
#include "laboratory/report/table.h"

namespace slabstream {

struct Figure {
  std::string name;  // of its file, unique in a report: "figure-7-transform"
  std::string svg;   // of Draw...
  std::string caption;
};

// A rendered picture, embedded in the page.
struct Photo {
  std::string png;  // the bytes of the file
  std::string caption;
};

using Block = std::variant<Figure, Table, Photo>;

struct Section {
  std::string title;
  std::string question, method, answer;  // plain text, a sentence or a few; empty ones are left out
  std::vector<Block> blocks;
};

// The data needed to repeat a run; at the page's head and in every result file.
struct Provenance {
  std::string experiment, version, commit, command;
  std::string cpu, simd;
  int cores = 0;
  std::uint64_t seed = 0;
  int repeats = 1;
  std::string date;  // UTC, of the end of the run: "2026-01-31 12:00"
};

struct Report {
  std::string title, summary;
  std::vector<Section> sections;
};

std::string ReportHtml(const Report& report, const Provenance& provenance);             // one file, nothing to load
nlohmann::ordered_json ReportJson(const Report& report, const Provenance& provenance);  // provenance, answers and all tables

// report.html, result.json, NAME.csv for each table, plots/NAME.svg for each figure. The folder exists.
Status WriteReport(const Report& report, const Provenance& provenance, const std::string& folder);

}  // namespace slabstream
