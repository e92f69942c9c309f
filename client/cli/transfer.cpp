// `transfer`: a preset as a file, to be changed and given to --transfer; or a list of them.
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <iostream>
#include <string>
#include <vector>

#include "client/cli/commands.h"
#include "client/cli/input_volume.h"
#include "client/pictures/picture_writer.h"
#include "common/classification/color_maps.h"
#include "common/image/local_image.h"
#include "common/mesh/summarize_cells.h"
#include "common/planning/resolved_request.h"

namespace slabstream {
namespace {

TransferFunction FunctionOf(const ColorMap& map) {
  TransferFunction transfer{.colors = {}, .opacities = {}};
  for (const auto& [at, color] : map.points) transfer.colors.push_back({at, color});
  return transfer;
}

// A bar for a terminal that knows colours of 24 bits.
std::string TerminalBar(const ColorMap& map) {
  constexpr int kCells = 32;
  const TransferFunction transfer = FunctionOf(map);
  std::string bar;
  for (int i = 0; i < kCells; ++i) {
    const auto [r, g, b] = transfer.Color((i + 0.5) / kCells);
    const auto code = [](float channel) { return int(std::lround(255 * channel)); };
    bar += fmt::format("\x1b[48;2;{};{};{}m ", code(r), code(g), code(b));
  }
  return bar + "\x1b[0m ";
}

std::string ListText(bool colors) {
  std::size_t widest = 0;
  for (const TransferPreset& preset : TransferPresets()) widest = std::max(widest, preset.name.size());
  std::string text;
  for (const TransferPreset& preset : TransferPresets()) {
    const ColorMap* const map = preset.map;
    text += fmt::format("{:<{}}  {}{}", preset.name, widest, colors && map != nullptr ? TerminalBar(*map) : "", preset.purpose);
    text += map != nullptr ? fmt::format(" ({})\n", map->source) : "\n";
  }
  return text;
}

// A line for each map: its name, black on white, and its colours.
Status DrawMaps(const std::string& path) {
  constexpr int kNames = 100, kColors = 400, kHeight = 28, kLetters = 16;
  const std::vector<ColorMap>& maps = NamedColorMaps();
  Result<Font> font = Font::Open();
  if (!font.ok()) return font.status();
  const ImageSize size = {kNames + kColors, kHeight * int(maps.size())};
  LocalImage image = MakeLocalImage(PixelFormat::kRgba, {0, 0, size.width, size.height});
  const auto set = [&](int x, int y, const Rgb& color) {
    float* const pixel = &image.rgba[4 * (std::size_t(y) * std::size_t(size.width) + std::size_t(x))];
    pixel[0] = color.r;
    pixel[1] = color.g;
    pixel[2] = color.b;
    pixel[3] = 1;
  };
  for (int i = 0; i < int(maps.size()); ++i) {
    const TransferFunction transfer = FunctionOf(maps[std::size_t(i)]);
    for (int y = i * kHeight; y < (i + 1) * kHeight; ++y) {
      for (int x = 0; x < kNames; ++x) set(x, y, {1, 1, 1});
      for (int x = 0; x < kColors; ++x) set(kNames + x, y, transfer.Color((x + 0.5) / kColors));
    }
    const Ink ink =
        Shifted(font->Draw(maps[std::size_t(i)].name, kLetters), kLetters / 2, i * kHeight + (kHeight + kLetters) / 2 - kLetters / 5);
    for (int y = std::max(ink.bounds.y_begin, 0); y < std::min(ink.bounds.y_end, size.height); ++y) {
      for (int x = std::max(ink.bounds.x_begin, 0); x < std::min(ink.bounds.x_end, kNames); ++x) {
        const auto at = std::size_t(y - ink.bounds.y_begin) * std::size_t(ink.bounds.width()) + std::size_t(x - ink.bounds.x_begin);
        const float paper = 1 - ink.coverage[at];
        set(x, y, {paper, paper, paper});
      }
    }
  }
  return WritePicture(image, size, path, {});
}

Status List(const TransferOptions& options) {
  if (!options.preview.empty()) {
    if (Status status = CheckCanWritePicture(options.preview); !status.ok()) return status;
    if (Status status = DrawMaps(options.preview); !status.ok()) return status;
  }
  std::cout << ListText(::isatty(STDOUT_FILENO) == 1);
  return Status::Ok();
}

}  // namespace

Status RunTransfer(const TransferOptions& options) {
  if (options.list) return List(options);
  if (options.path.empty()) return Status::InvalidArgument("PRESET and SOURCE are required, or --list");
  if (Status status = CheckInputVolume(options.path); !status.ok()) return status;
  const Result<LoadedVolume> loaded = ReadInputVolume(options.path);
  if (!loaded.ok()) return loaded.status();
  const Result<TransferFunction> transfer = ResolveTransfer(options.request.transfer, SummaryOf(*loaded->volume));
  if (!transfer.ok()) return transfer.status();
  std::cout << FormatParaViewColorMap(*transfer, std::get<std::string>(options.request.transfer.choice));
  return Status::Ok();
}

}  // namespace slabstream
