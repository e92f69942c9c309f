#include "bench/program.h"

#include "common/base/version.h"
#include "common/mesh/summarize_cells.h"
#include "common/planning/count_drawn.h"
#include "common/text/parse_number.h"

namespace slabstream {
namespace {

Result<BenchCase> ParseSubject(const SubjectOptions& options, const std::string& text) {
  Result<BenchCase> parsed = Status::InvalidArgument("");
  const bool hollow = text.starts_with("sphere1:");
  if (!hollow && !text.starts_with("sphere2:")) {
    parsed = ParseBenchCase(text, false);
    if (parsed.ok()) parsed->renderer = options.renderer;
    return parsed;
  }
  const std::size_t colon = text.find(':', 8);
  const std::optional<int> size = ParseNumber<int>(text.substr(8, colon - 8));
  if (!size) return Status::InvalidArgument(fmt::format("'{}' has no number of voxels after the colon", text));
  parsed = StandardSphere(hollow ? SphereClass::kHollow : SphereClass::kFilled, *size, options.renderer);
  if (colon != std::string::npos) parsed->transfer.choice = text.substr(colon + 1);
  return parsed;
}

}  // namespace

int BenchMain(int argc, const char* const* argv, const std::string& name, const std::string& description,
              const std::function<void(const Command&)>& add_options, const std::function<Status()>& run) {
  return RunMain(name, [&] {
    const Program program(description, name, std::string(Version()));
    add_options(program);
    return ParseAndRun(program, argc, argv, run);
  });
}

Option AddRenderer(const Command& app, const RendererKind*& target, const std::string& help) {
  const auto parse = [](const std::string&, const std::string& text) { return RequireRenderer(text); };
  return AddParsed(app, "--renderer", target, parse, fmt::format("{}: {}", help, fmt::join(RendererNames(), ", ")))
      .TypeName("NAME")
      .Default(target == nullptr ? "" : std::string(target->name()));
}

void AddSubjectOptions(const Command& app, SubjectOptions& options) {
  app.AddTexts("VOLUME", options.volumes, "Standard cases of `slabstream bench`, FILE[:TRANSFER], or sphere1:N and sphere2:N[:PRESET]")
      .Required();
  AddRenderer(app, options.renderer);
  AddInteger(app, "--size", options.size, 1, kMaxImageSide, "Pixels a side");
  AddNumber(app, "--azimuth", options.azimuth, {-360, 360}, "Degrees that the eye turns about +z");
  AddNumber(app, "--elevation", options.elevation, {-360, 360}, "Degrees that the eye is lifted towards +z");
  AddNumber(app, "--zoom", options.zoom, {0.01, kMaxZoom}, "Magnification");
}

Result<Subject> LoadSubject(const SubjectOptions& options, const std::string& text) {
  const Result<BenchCase> parsed = ParseSubject(options, text);
  if (!parsed.ok()) return parsed.status();
  const Result<std::shared_ptr<const Volume>> volume = LoadBenchVolume(*parsed);
  if (!volume.ok()) return volume.status();
  Subject subject{.name = parsed->name, .volume = *volume, .summary = std::make_shared<const VolumeSummary>(SummaryOf(**volume))};
  const ViewParameters view{.azimuth_degrees = options.azimuth, .elevation_degrees = options.elevation, .zoom = options.zoom};
  subject.request = BenchRequest(*parsed, view, {options.size, options.size});
  const Result<ResolvedRequest> resolved = ResolveRequest(subject.request, 1, subject.summary);
  if (!resolved.ok()) return resolved.status();
  Result<FrameSetup> setup = MakeFrameSetup(*resolved);
  if (!setup.ok()) return setup.status();
  subject.setup = *std::move(setup);
  subject.occupied =
      std::make_shared<const OccupancyGrid>(CountDrawn(*subject.volume, *subject.summary, *parsed->renderer, subject.setup.transfer));
  return subject;
}

}  // namespace slabstream
