// The options of a command as JSON, for programs that offer the same ones, such as the Python package (python/slabstream/options.json).
#pragma once

#include <string>

namespace CLI {
class App;
}

namespace slabstream {

// A list in the order of the help text, without hidden options. Each has a name without dashes (or of a positional argument) and a help
// text; and where they apply: group, type (none: a flag), default, choices, min or above, max, repeatable, required, excludes, needs.
std::string DescribeOptions(CLI::App& command);

}  // namespace slabstream
