// The manual page of a program, or of a command of it, from the declarations that its help text comes from.
#pragma once

#include <string>

#include "common/cli/command.h"

namespace slabstream {

// In man(7). `name` is what the user types: "slabstream render". The commands of a program are listed, as they have pages of their own
// ("slabstream-render"); those of a command are part of its page.
std::string ManPage(const Command& app, const std::string& name);

}  // namespace slabstream
