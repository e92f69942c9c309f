// Options that several subcommands share.
#pragma once

#include <functional>
#include <initializer_list>
#include <string>
#include <string_view>
#include <vector>

#include "client/cli/options.h"
#include "client/request/picture_options.h"
#include "common/cli/command.h"

namespace slabstream {

// Headings of the help text.
inline constexpr char kOutputGroup[] = "Output", kReadingGroup[] = "Reading a file";

// --threads, [1, kMaxThreads]; 0 stays if it is not given.
Option AddThreads(const Command& app, int& threads, const std::string& help);

// An option for each of ReadOptionList() but those of `except`: --time 3 says what ?time=3 behind a source says.
void AddReadOptions(const Command& app, std::initializer_list<std::string_view> except = {});
// After the parse, adds those that were given to the `source`, which is a file.
void TakeReadOptions(const Command& app, std::string& source);

// After the parse, splits a `source` of the form VOLUME:TRANSFER into its parts (volume_argument.h) and adds what AddReadOptions took,
// which must be about a file. Calls `is_file` only then.
void ResolveSource(const Command& app, Option source, std::string& volume, TransferChoice& transfer, std::function<bool()> is_file);

// SOURCE, a dataset or with --local a file, with the options for reading it, and where it is; and which of its channels and times. What
// only a file has, such as a component of its voxels, is an option for reading it.
void AddSource(const Command& app, AskedVolume& volume);

// All options of `slice` but its output.
void AddSliceOptions(const Command& app, SliceOptions& options);

// All options that `render` and `turntable` share: SOURCE, connection, view, look, policy, and the files written beside pictures.
// Options of the request that `app` has already, in a form of its own, stay. `sources`: gets one or more SOURCEs; null: there is one, in
// `options`.
void AddFrameOptions(const Command& app, FrameOptions& options, std::vector<SourceChoice>* sources = nullptr);

}  // namespace slabstream
