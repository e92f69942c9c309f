#include "laboratory/report/table.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "common/base/check.h"
#include "laboratory/report/base64.h"
#include "laboratory/report/text.h"

namespace slabstream {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::size_t kMostOpenRows = 24;

template <class Has>
bool AnyCell(const Table& table, std::size_t column, Has has) {
  return std::ranges::any_of(table.rows, [&](const std::vector<Cell>& row) { return has(row[column]); });
}
bool HasInterval(const Cell& cell) { return cell.low.has_value(); }
bool HasOrigin(const Cell& cell) { return cell.origin.has_value(); }

// Numbers in full precision, for programs.
std::string Exact(const std::optional<double>& number) { return number && std::isfinite(*number) ? fmt::format("{}", *number) : ""; }

std::string CsvField(const std::string& text) {
  if (text.find_first_of(",\"\r\n") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char c : text) quoted += c == '"' ? std::string("\"\"") : std::string(1, c);
  return quoted + '"';
}

std::string CellHtml(const Cell& cell) {
  if (!cell.number) return cell.text.empty() ? "<td class=\"none\">–</td>" : fmt::format("<td class=\"words\">{}</td>", Escape(cell.text));
  std::string shown = FormatNumber(*cell.number);
  if (cell.low && *cell.low < *cell.high) {
    shown += fmt::format(" <small>({} … {})</small>", FormatNumber(*cell.low), FormatNumber(*cell.high));
  }
  return fmt::format("<td class=\"{}\">{}</td>", cell.origin ? ToString(*cell.origin) : "chosen", shown);
}

}  // namespace

Cell::Cell(const Estimate& estimate, Origin from) : number(estimate.median), origin(from) {
  if (estimate.count > 1) {
    low = estimate.low;
    high = estimate.high;
  }
}

Cell Chosen(double number) {
  Cell cell;
  cell.number = number;
  return cell;
}

Column::Column(std::string text) : heading(std::move(text)), name(heading.substr(0, heading.find(" ("))) {
  if (name.size() < heading.size()) unit = heading.substr(name.size() + 2, heading.size() - name.size() - 3);
}

std::string TableCsv(const Table& table) {
  std::vector<std::string> header;
  for (std::size_t c = 0; c < table.columns.size(); ++c) {
    const Column& column = table.columns[c];
    header.push_back(CsvField(column.heading));
    if (AnyCell(table, c, HasInterval)) header.insert(header.end(), {CsvField(column.name + " low"), CsvField(column.name + " high")});
    if (AnyCell(table, c, HasOrigin)) header.push_back(CsvField(column.name + " origin"));
  }
  std::string csv = fmt::format("{}\r\n", fmt::join(header, ","));
  for (const std::vector<Cell>& row : table.rows) {
    CHECK_EQ(row.size(), table.columns.size()) << table.name;
    std::vector<std::string> fields;
    for (std::size_t c = 0; c < row.size(); ++c) {
      fields.push_back(row[c].number ? Exact(row[c].number) : CsvField(row[c].text));
      if (AnyCell(table, c, HasInterval)) fields.insert(fields.end(), {Exact(row[c].low), Exact(row[c].high)});
      if (AnyCell(table, c, HasOrigin)) fields.emplace_back(row[c].origin ? ToString(*row[c].origin) : "");
    }
    csv += fmt::format("{}\r\n", fmt::join(fields, ","));
  }
  return csv;
}

Json TableJson(const Table& table) {
  Json json = {{"name", table.name}, {"title", table.title}, {"columns", Json::array()}, {"rows", Json::array()}};
  for (const Column& column : table.columns) json["columns"].push_back({{"name", column.name}, {"unit", column.unit}});
  for (const std::vector<Cell>& row : table.rows) {
    Json values = Json::object();
    for (std::size_t c = 0; c < row.size(); ++c) {
      const Cell& cell = row[c];
      Json value = cell.number ? Json(*cell.number) : cell.text.empty() ? Json() : Json(cell.text);
      if (cell.origin) {
        value = {{"value", value}, {"origin", ToString(*cell.origin)}};
        if (cell.low) value.update({{"low", *cell.low}, {"high", *cell.high}});
      }
      values[table.columns[c].name] = std::move(value);
    }
    json["rows"].push_back(std::move(values));
  }
  return json;
}

std::string TableHtml(const Table& table) {
  const bool folded = table.rows.size() > kMostOpenRows;
  std::string html = folded ? fmt::format("<details><summary>{} ({} rows)</summary>", Escape(table.title), table.rows.size()) : "";
  html += fmt::format(
      "<div class=\"table\"><table><caption>{} <a download=\"{}.csv\" href=\"data:text/csv;charset=utf-8;base64,{}\">CSV</a></caption>"
      "<thead><tr>",
      Escape(table.title), Escape(table.name), Base64(TableCsv(table)));
  for (const Column& column : table.columns) html += fmt::format("<th>{}</th>", Escape(column.heading));
  html += "</tr></thead><tbody>\n";
  bool told = false;
  for (const std::vector<Cell>& row : table.rows) {
    html += "<tr>";
    for (const Cell& cell : row) {
      html += CellHtml(cell);
      told = told || cell.origin.has_value();
    }
    html += "</tr>\n";
  }
  html += "</tbody></table>";
  if (told) {
    html +=
        "<p class=\"key\"><span class=\"measured\">bold: measured here</span>, <span class=\"simulated\">italic: simulated</span>, "
        "<span class=\"paper\">grey: from the paper</span></p>";
  }
  return html + (folded ? "</div></details>\n" : "</div>\n");
}

}  // namespace slabstream
