#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "laboratory/report/base64.h"
#include "laboratory/report/document.h"
#include "laboratory/report/text.h"

namespace slabstream {
namespace {

constexpr std::string_view kPageStyle = R"(<style>
:root{color-scheme:light dark}
body{font:16px/1.55 system-ui,'DejaVu Sans',sans-serif;max-width:62rem;margin:2rem auto;padding:0 1.2rem;color:#222;background:#fff}
h1{margin-bottom:.2rem}h2{margin-top:2.6rem;border-top:1px solid #ccc;padding-top:1.2rem}
.summary{font-size:1.1rem}.provenance,.key,figcaption,caption{color:#555;font-size:.88rem}.provenance code{word-break:break-all}
.answer{border-left:4px solid #0072b2;padding:.3rem .9rem;background:#f2f7fb;font-weight:600}
dt{font-weight:600}figure{margin:1.4rem 0;overflow-x:auto}svg{max-width:100%;height:auto}img{max-width:24rem;width:100%}
.table{overflow-x:auto;margin:1.2rem 0}table{border-collapse:collapse;font-size:.9rem;font-variant-numeric:tabular-nums}
summary{cursor:pointer;color:#555}caption{text-align:left;padding-bottom:.3rem}th,td{padding:.22rem .7rem;border-bottom:1px solid #ddd;text-align:right;white-space:nowrap}
th{border-bottom:2px solid #999;vertical-align:bottom}td.words{text-align:left}
.measured{font-weight:600}.simulated{font-style:italic}.paper,.none{color:#777}small{font-weight:400}
nav ol{columns:2;font-size:.95rem}a{color:#0060a0}
@media (prefers-color-scheme:dark){body{color:#e4e4e4;background:#181818}.provenance,.key,figcaption,caption,summary{color:#aaa}.paper,.none{color:#999}
.answer{background:#1d2a35;border-color:#4db2ff}h2{border-color:#444}th,td{border-color:#3a3a3a}th{border-bottom-color:#777}a{color:#7fc4ff}}
@media print{body{max-width:none}h2{break-after:avoid}figure,.table{break-inside:avoid}}
</style>)";

std::string Row(std::string_view term, const std::string& text) {
  return text.empty() ? "" : fmt::format("<p><b>{}</b> {}</p>\n", term, Escape(text));
}

struct BlockHtml {
  std::string operator()(const Figure& figure) const {
    return fmt::format("<figure id=\"{}\">\n{}<figcaption>{}</figcaption></figure>\n", Escape(figure.name), figure.svg,
                       Escape(figure.caption));
  }
  std::string operator()(const Table& table) const { return TableHtml(table); }
  std::string operator()(const Photo& photo) const {
    return fmt::format("<figure><img alt=\"{0}\" src=\"data:image/png;base64,{1}\"/><figcaption>{0}</figcaption></figure>\n",
                       Escape(photo.caption), Base64(photo.png));
  }
};

std::string ProvenanceHtml(const Provenance& p) {
  return fmt::format(
      "<p class=\"provenance\">{} · Slabstream {} ({}) · {}, {} cores, {} · seed {}, {} repeats<br/><code>{}</code><br/>"
      "Medians; intervals in brackets and whiskers are those of order statistics (95 % confidence from six repeats on, below that the "
      "smallest and the largest value). Every table can be saved as CSV; all of them are in result.json, which was written beside this "
      "page.</p>\n",
      Escape(p.date), Escape(p.version), Escape(p.commit), Escape(p.cpu), p.cores, Escape(p.simd), p.seed, p.repeats, Escape(p.command));
}

}  // namespace

std::string ReportHtml(const Report& report, const Provenance& provenance) {
  std::string html = fmt::format(
      "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"/><meta name=\"viewport\" content=\"width=device-width\"/>"
      "<title>{0}</title>\n{1}</head><body>\n<h1>{0}</h1>\n<p class=\"summary\">{2}</p>\n",
      Escape(report.title), kPageStyle, Escape(report.summary));
  html += ProvenanceHtml(provenance);
  if (report.sections.size() > 2) {
    html += "<nav><ol>\n";
    for (const Section& section : report.sections)
      html += fmt::format("<li><a href=\"#{}\">{}</a></li>\n", Slug(section.title), Escape(section.title));
    html += "</ol></nav>\n";
  }
  for (const Section& section : report.sections) {
    html += fmt::format("<section><h2 id=\"{}\">{}</h2>\n", Slug(section.title), Escape(section.title));
    html += Row("Question.", section.question) + Row("Done.", section.method);
    if (!section.answer.empty()) html += fmt::format("<p class=\"answer\">{}</p>\n", Escape(section.answer));
    for (const Block& block : section.blocks) html += std::visit(BlockHtml(), block);
    html += "</section>\n";
  }
  return html + "</body></html>\n";
}

}  // namespace slabstream
