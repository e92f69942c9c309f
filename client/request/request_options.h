// The fields of a FrameRequest as options: their names, texts and limits, as the schema describes them (proto/slabstream/v1/about.proto).
// Command line, queries, files and records of pictures all read this table. Any thread.
#pragma once

#include <initializer_list>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "client/request/json_value.h"
#include "common/base/status.h"
#include "common/cli/parse.h"
#include "common/frame/frame_request.h"

namespace slabstream {

struct RequestOption {
  std::string name;      // "clip-box"
  std::string path;      // the field's path in the request, "clipping.box"; for a renderer's parameter "parameters.sampling-rate"
  std::string group;     // heading in help texts
  std::string help;      // lines after the first one explain the choices
  std::string value;     // what the help shows for it, such as "NUMBER"; empty: a flag
  std::string standard;  // text; empty: none
  std::string unit;
  std::string ability;               // the ability that the renderer needs (common/renderers/ability.h); empty: none
  std::vector<std::string> choices;  // empty: it is no choice
  std::optional<NumberRange> range;
  bool repeatable = false;
  bool same_picture = false;                 // it never changes the finished picture
  bool negatable = false;                    // a flag that may be on without being given: --no-NAME turns it off
  std::vector<std::string> excludes, needs;  // names of others

  bool flag() const { return value.empty(); }
};

// In the order of help texts.
const std::vector<RequestOption>& RequestOptions();
// Null: none has this name. '_' stands for '-', too.
const RequestOption* FindRequestOption(std::string_view name);

// Colour maps may be files that texts name, or only texts themselves.
enum class ColorMaps : bool { kTexts, kFilesToo };

// Sets the field. `texts`: one, or of a repeatable option one for each time. A flag: "true" or "false". An option of single channels sets
// it in the looks of those that it names. InvalidArgument in one line that begins with `shown` ("--clip-box").
Status SetOption(const RequestOption& option, const std::string& shown, std::span<const std::string> texts, ColorMaps maps,
                 FrameRequest& request);

// The texts that set the field to what it is in `request`; none if it has its standard value. Labels that are
// shown have always one text. A transfer function that is no preset stands as the name of a file: see MapFilesOf.
std::vector<std::string> TextsOf(const RequestOption& option, const FrameRequest& request);

// The files that a command line names for transfer functions that are not presets, by their names, in ParaView's format.
std::map<std::string, std::string> MapFilesOf(const FrameRequest& request);

// The texts of an option's value in JSON: of a text, number, boolean or colour map; lists of numbers are joined by commas; lists of a
// repeatable option are one text for each item. Nothing: the value is of another kind.
std::optional<std::vector<std::string>> TextsOfJson(const Json& value, bool repeatable);

// The options whose paths begin with one of `places` ("view."), as fields of a JSON object that set them in `request`.
std::vector<std::pair<std::string, JsonValue::Read>> OptionFields(FrameRequest& request, std::initializer_list<std::string_view> places);
// The other way round: an object of those options whose values are not standard.
Json OptionsJson(const FrameRequest& request, std::string_view place);

}  // namespace slabstream
