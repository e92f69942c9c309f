#include "client/request/volume_argument.h"

#include <fmt/format.h>

#include <filesystem>
#include <string_view>

#include "common/base/did_you_mean.h"
#include "common/base/find_named.h"
#include "common/files/files.h"
#include "common/text/url.h"
#include "data/volume_io/read_options.h"

namespace slabstream {
namespace {

constexpr std::size_t kMaxTransferFileBytes = std::size_t{16} << 20;

using TransferText = std::variant<std::string, TransferFunction>;

// Options are checked with the volume.
bool Exists(const std::string& volume) {
  const Result<SourceText> source = ParseSourceText(volume);
  return source.ok() && MayBeThere(*source);
}

bool IsJson(const std::string& text) { return text.starts_with('{') || text.starts_with('['); }

Result<TransferText> ReadColorMap(const std::string& option, const std::string& json, const std::string& name) {
  Result<TransferFunction> transfer = ParseParaViewColorMap(json, name);
  if (!transfer.ok()) return Status(transfer.status().code(), fmt::format("{} {}", option, transfer.status().message()));
  return TransferText(*std::move(transfer));
}

// `more`: what else it might have been.
Status NoTransfer(const std::string& option, const std::string& text, std::string_view more) {
  return Status::InvalidArgument(fmt::format("{} '{}' is not one of {}, nor JSON of a colour map{}{}", option, text,
                                             NamesOf(TransferPresets()), more, DidYouMean(text, TransferPresets())));
}

bool NamesFile(const std::string& transfer) {
  if (IsJson(transfer)) return false;
  return std::filesystem::path(transfer).extension() == ".json" || transfer.find('/') != std::string::npos;
}

}  // namespace

Result<std::variant<std::string, TransferFunction>> ParseTransferText(const std::string& option, const std::string& text) {
  if (IsJson(text)) return ReadColorMap(option, text, "the colour map");
  if (FindNamed(TransferPresets(), text) == nullptr) return NoTransfer(option, text, "");
  return TransferText(text);
}

Result<std::variant<std::string, TransferFunction>> ParseTransfer(const std::string& option, const std::string& text) {
  if (NamesFile(text)) {
    const Result<std::string> json = ReadTextFile(text, kMaxTransferFileBytes);
    if (!json.ok()) return Status(json.status().code(), fmt::format("{} {}", option, json.status().message()));
    return ReadColorMap(option, *json, text);
  }
  if (!IsJson(text) && FindNamed(TransferPresets(), text) == nullptr) return NoTransfer(option, text, ", nor a .json file");
  return ParseTransferText(option, text);
}

bool NamesVolumeFile(const std::string& text) { return Exists(text) || Exists(text.substr(0, text.rfind(':'))); }

Result<VolumeArgument> ParseVolumeArgument(const std::string& argument, const std::string& text, bool is_file) {
  const VolumeArgument whole{text, "", {}};
  const std::size_t colon = text.rfind(':');
  // A colon of the scheme, of a port, or of how other programs spell an address.
  const std::size_t host = SchemeOf(text).empty() ? text.size() : text.rfind("://") + 3;
  const std::size_t bar = text.find('|');
  const bool of_spelling = bar < colon && colon < text.find('?', bar);
  const bool of_address = colon != std::string::npos && host < text.size() && (of_spelling || colon < text.find_first_of("/?,", host));
  std::error_code error;
  if (colon == std::string::npos || of_address || (is_file && std::filesystem::exists(text, error))) return whole;
  VolumeArgument parts{text.substr(0, colon), text.substr(colon + 1), {}};
  if (is_file && !Exists(parts.volume)) return whole;
  auto transfer = ParseTransfer(fmt::format("{} '{}':", argument, text), parts.transfer_text);
  if (!transfer.ok() && !is_file && !NamesFile(parts.transfer_text)) return whole;
  if (!transfer.ok() && text.find('?') < colon && Exists(text)) return whole;  // the value of an option may hold a colon
  if (!transfer.ok()) return transfer.status();
  parts.transfer = *std::move(transfer);
  return parts;
}

}  // namespace slabstream
