#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <iostream>
#include <optional>
#include <vector>

#include "client/cli/commands.h"
#include "client/cli/convert_parts.h"
#include "client/cli/input_volume.h"
#include "client/cli/progress.h"
#include "common/base/log.h"
#include "common/files/files.h"
#include "common/volume/memory_budget.h"
#include "data/open/open_source.h"
#include "data/open/read_volume.h"
#include "data/stores/object_cache.h"
#include "data/volume_io/exact_samples.h"
#include "data/volume_io/formats.h"
#include "data/volume_io/volume_writer.h"

namespace slabstream {
namespace {

// The output never takes the place of the input, although the input has been read by then.
Status CheckKeepsInput(const ConvertOptions& options, const VolumeFormat& format, const std::vector<std::filesystem::path>& inputs) {
  std::vector<std::filesystem::path> outputs = {options.output};
  if (format.second_file != nullptr) outputs.push_back(format.second_file(options.output));
  for (const std::filesystem::path& output : outputs) {
    for (const std::filesystem::path& input : inputs) {
      std::error_code error;
      if (!std::filesystem::equivalent(output, input, error) || error) continue;
      return Status::InvalidArgument(fmt::format("OUTPUT '{}': would overwrite the input '{}'", options.output, input.string()));
    }
  }
  return Status::Ok();
}

// Samples keep the type that they have in the file, if it holds their values after the file's rescaling.
std::optional<SampleType> TypeToWrite(const ConvertOptions& options, const LoadedVolume& loaded) {
  if (options.type) return options.type;
  const std::optional<SampleType> stored = SampleTypeNamed(loaded.info.file_type);
  return stored && FileSamples::Of(*loaded.volume, loaded.exact.get(), stored).ok() ? stored : std::nullopt;
}

// Whether floats that somebody asks for round whole numbers.
bool RoundsLabels(SampleType type, const ExactSamples& exact) {
  if (!MayRoundLabels(exact.of.type)) return false;
  if (type == SampleType::kFloat32) return !AllFitFloat(exact.of.type, exact.bytes);
  if (type != SampleType::kFloat64) return false;
  const std::size_t bytes = BytesPerSample(exact.of.type);
  for (std::size_t i = 0; i < exact.bytes.size(); i += bytes) {
    if (ExactValueOf({exact.of.type, {}}, exact.bytes.data() + i).rest != 0) return true;
  }
  return false;
}

// A box of a level, or the whole volume.
Result<LoadedVolume> Read(const ConvertOptions& options, const SourceText& source) {
  const Result<SourceToConvert> opened = OpenToConvert(options, source, {});
  if (!opened.ok()) return opened.status();
  Result<LoadedVolume> loaded = ReadVolume(*opened->source, source.path, source.options, {.all_exact = true});
  if (loaded.ok()) WarnOfPart(source.path, source.options, loaded->info);
  if (!loaded.ok()) return loaded.status();
  return loaded;
}

}  // namespace

Status RunConvert(const ConvertOptions& options) {
  if (Status kept = KeepObjects(options.cache); !kept.ok()) return kept;
  Result<SourceText> source = ParseSourceText(options.source);
  if (!source.ok()) return source.status();
  // --type is also that of raw samples, unless they have one of their own.
  const VolumeFormat* const from = FindFormat(source->path, source->options);
  const bool needs_type = from != nullptr && std::ranges::count(from->required, "type") > 0;
  if (needs_type && !source->options.type) source->options.type = options.type;
  if (Status status = CheckInputVolume(*source); !status.ok()) return status;
  if (options.memory > 0) LimitMemory(options.memory);
  if (NamesZarr(options.output)) {
    if (options.type && !needs_type) return Status::InvalidArgument("--type: an OME-Zarr keeps the type of SOURCE");
    return ConvertToZarr(options, *source);
  }
  const VolumeFormat* const to = FindWritableFormat(options.output);
  if (to == nullptr) {
    return Status::InvalidArgument(fmt::format("OUTPUT '{}' must end in one of {}, .zarr", options.output, WritableEndings()));
  }
  if (Status status = CheckKeepsInput(options, *to, {source->path}); !status.ok()) return status;
  if (Status status = CheckCanWrite("OUTPUT", options.output); !status.ok()) return status;

  ProgressBar bar(options.progress, 1);
  ReadProgress reading([&](const ReadShare& read) { bar.Show(0.01 * read.percent, Describe(read, source->path)); });
  bar.Show(0, Describe(ReadShare{}, source->path));
  source->options.progress = &reading;
  const Result<LoadedVolume> loaded = Read(options, *source);
  if (!loaded.ok()) return loaded.status();
  const SourceInfo& info = loaded->info;
  if (Status status = CheckKeepsInput(options, *to, std::vector<std::filesystem::path>(info.files.begin(), info.files.end())); !status.ok())
    return status;
  if (const std::string lost = WhatIsLost(*to, info.finest().geometry); !lost.empty()) {
    LogWarning(fmt::format("{}: {} files do not keep {}", options.output, to->name, lost));
  }
  if (options.type && loaded->exact != nullptr && RoundsLabels(*options.type, *loaded->exact)) {
    LogWarning(fmt::format("--type {} rounds values of type {}", ToString(*options.type), ToString(loaded->exact->of.type)));
  }
  const auto progress = [&](std::int64_t done, std::int64_t all) {
    const std::string size = MemoryText(std::uint64_t(all));
    bar.Show(double(done) / double(all), fmt::format("writing {}: {} % of {}", options.output, done * 100 / all, size));
  };
  if (Status status = WriteVolume(*loaded->volume, options.output, {TypeToWrite(options, *loaded), progress, loaded->exact.get()});
      !status.ok())
    return status;
  const Index3& size = info.finest().geometry.size;
  std::cout << fmt::format("wrote {}: {}, {} x {} x {} voxels\n", options.output, to->name, size.x, size.y, size.z);
  return Status::Ok();
}

}  // namespace slabstream
