#include "laboratory/report/document.h"

#include <fmt/format.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "common/base/files.h"

namespace slabstream {

nlohmann::ordered_json ReportJson(const Report& report, const Provenance& p) {
  nlohmann::ordered_json json = {{"experiment", p.experiment},
                                 {"version", p.version},
                                 {"commit", p.commit},
                                 {"command", p.command},
                                 {"machine", {{"cpu", p.cpu}, {"cores", p.cores}, {"simd", p.simd}}},
                                 {"seed", p.seed},
                                 {"repeats", p.repeats},
                                 {"date", p.date},
                                 {"answers", nlohmann::ordered_json::array()},
                                 {"tables", nlohmann::ordered_json::array()}};
  for (const Section& section : report.sections) {
    if (!section.answer.empty()) json["answers"].push_back({{"section", section.title}, {"answer", section.answer}});
    for (const Block& block : section.blocks) {
      if (const auto* table = std::get_if<Table>(&block)) json["tables"].push_back(TableJson(*table));
    }
  }
  return json;
}

Status WriteReport(const Report& report, const Provenance& provenance, const std::string& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder + "/plots", error);
  if (error) return Status::Unavailable(fmt::format("'{}/plots' cannot be made: {}", folder, error.message()));
  const auto write = [&](const std::string& name, const std::string& text) { return WriteTextFile(folder + "/" + name, text); };
  for (const Section& section : report.sections) {
    for (const Block& block : section.blocks) {
      Status status;
      if (const auto* table = std::get_if<Table>(&block)) status = write(table->name + ".csv", TableCsv(*table));
      if (const auto* figure = std::get_if<Figure>(&block)) status = write("plots/" + figure->name + ".svg", figure->svg);
      if (!status.ok()) return status;
    }
  }
  const auto json = ReportJson(report, provenance).dump(1, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n";
  if (Status status = write("result.json", json); !status.ok()) return status;
  return write("report.html", ReportHtml(report, provenance));  // last: whoever sees it finds all other files
}

}  // namespace slabstream
