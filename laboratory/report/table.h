// Table: the numbers behind a section, for people (HTML) and for programs (CSV, JSON). Pure.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "laboratory/measure/statistics.h"
#include "laboratory/results/origin.h"

namespace slabstream {

// Nothing (shown as a dash), a text, or a number with its origin and, if it was measured several times, its interval.
struct Cell {
  Cell() = default;
  Cell(std::string words) : text(std::move(words)) {}  // NOLINT(google-explicit-constructor): rows read as lists of values
  Cell(const char* words) : text(words) {}             // NOLINT(google-explicit-constructor)
  Cell(double value, Origin from) : number(value), origin(from) {}
  Cell(const Estimate& estimate, Origin from);

  std::string text;
  std::optional<double> number, low, high;
  std::optional<Origin> origin;
};

inline Cell Measured(const auto& number) { return {number, Origin::kMeasured}; }
inline Cell Simulated(const auto& number) { return {number, Origin::kSimulated}; }
inline Cell FromPaper(double number) { return {number, Origin::kPaper}; }
Cell Chosen(double number);  // no result, so it has no origin

struct Column {
  // "frame (ms)" or "p": the name, which is unique in its table, and the unit in brackets unless it is a plain number or a text.
  Column(std::string text);                                // NOLINT(google-explicit-constructor): columns read as a list of headings
  Column(const char* text) : Column(std::string(text)) {}  // NOLINT(google-explicit-constructor)

  std::string heading, name, unit;
};

struct Table {
  std::string name;   // of its file, unique in a report: "table-5-splatting"
  std::string title;  // one line
  std::vector<Column> columns;
  std::vector<std::vector<Cell>> rows;  // each as long as columns
};

// RFC 4180 with a header line "name (unit)". A column with intervals is followed by "name low" and "name high", one with origins by "name
// origin".
std::string TableCsv(const Table& table);
// {name, title, columns: [...], rows: [{column: value or {value, low, high, origin}}]}
nlohmann::ordered_json TableJson(const Table& table);
std::string TableHtml(const Table& table);  // holds the CSV too, to be saved; a long one is folded

}  // namespace slabstream
