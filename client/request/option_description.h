// The options of a command as JSON, for programs that offer the same ones: `slabstream options`, the gateway, the viewer's page and the
// Python package (python/slabstream/options.json).
#pragma once

#include "common/json/json.h"

#include "common/cli/command.h"

namespace slabstream {

// A list in the order of the help text, without hidden options. Each has a name without dashes (or of a positional argument) and a help
// text; and where they apply: group, type (none: a flag), optional_value (of a flag that may have one: its type), default, choices, min or
// above, max, repeatable, required, excludes, needs. Fields of a request also have their path in it, and where they apply: unit, ability
// (that a renderer needs), same_picture (it never changes). The option renderer also tells what each of them is called and can do:
// renderers, a list of {name, title, purpose, abilities, parameters: {name: default}}; and which of them auto means: automatic, {volumes,
// grids}. Options that take a transfer function tell the names of its presets: presets, and of those that have regions: region_presets. The
// option window tells its named ones: windows, a list of {name, width, level}.
Json DescribeOptions(const Command& command);

}  // namespace slabstream
