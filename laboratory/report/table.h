// Table: the numbers behind a section, for people (HTML) and for programs (CSV, JSON). Pure.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "laboratory/measure/statistics.h"
#include "laboratory/report/origin.h"

namespace slabstream {

// Nothing (shown as a dash), a text, or a number with its origin and, if it was measured several times, its interval.
struct Cell {
  Cell() = default;
  Cell(std::string words) : text(std::move(words)) {}  // NOLINT(google-explicit-constructor): rows read as lists of values
  Cell(const char* words) : text(words) {}             // NOLINT(google-explicit-constructor)
  Cell(double value, Origin from) : number(value), origin(from) {}
  Cell(const Estimate& estimate, Origin from);
  static Cell Parameter(double value);  // a chosen number, not a result: it has no origin

  std::string text;
  std::optional<double> number, low, high;
  std::optional<Origin> origin;
};

struct Column {
  std::string name;  // unique in its table
  std::string unit;  // empty: a plain number or a text
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
nlohmann::ordered_json TableJson(
    const Table& table);                    // {name, title, columns: [...], rows: [{column: value or {value, low, high, origin}}]}
std::string TableHtml(const Table& table);  // holds the CSV too, to be saved; a long one is folded

}  // namespace slabstream
