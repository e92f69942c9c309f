// A volume on the command line, in the form that all commands accept: VOLUME or VOLUME:TRANSFER. VOLUME is a file, with options for
// reading it or without (data/volume_io/read_options.h), or, at a service, a dataset's name; TRANSFER is a value of --transfer.
#pragma once

#include <optional>
#include <string>
#include <variant>

#include "common/base/status.h"
#include "common/classification/transfer_function.h"

namespace slabstream {

// Whether VOLUME or VOLUME:TRANSFER names a file, or a folder, that exists.
bool NamesVolumeFile(const std::string& text);

// A value of --transfer: the name of a preset, or a ParaView colour map, as its JSON. `option` begins messages.
Result<std::variant<std::string, TransferFunction>> ParseTransferText(const std::string& option, const std::string& text);
// The same; and the colour map may also be the file that the text names.
Result<std::variant<std::string, TransferFunction>> ParseTransfer(const std::string& option, const std::string& text);

struct VolumeArgument {
  std::string volume;
  std::string transfer_text;  // empty: none was given
  std::optional<std::variant<std::string, TransferFunction>> transfer;
};

// A colon may also belong to the name of an existing file, or of a dataset if no preset or colour map follows it. Does not check that the
// volume exists. NotFound, InvalidArgument: the transfer function; `argument` ("SOURCE") begins messages.
Result<VolumeArgument> ParseVolumeArgument(const std::string& argument, const std::string& text, bool is_file);

}  // namespace slabstream
