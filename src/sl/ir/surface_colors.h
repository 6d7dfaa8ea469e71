// Where the Ci and Oi that a classic surface ends with come from.
#pragma once

#include "sl/ir/builder.h"

namespace kanuka::sl::ir {

// True if every store to the variable is the constant one.
bool always_one(const Stage& stage, const Builder& builder, int var);

// Does Oi come from Os? Then it is one on opaque surfaces, whose presence must stay a constant.
bool follows_opacity(const Program& program);

// Are all components of Oi alike? Never known, wherever Os has that, or in any case.
enum class Grey { Unknown, AsOs, Always };
Grey greyness(const Program& program, const Builder& builder);

// Is there anything but light in what Ci is left with? Its initial value does not count if it is overwritten
// at the top level.
bool ends_plain(const Program& program, const Builder& builder);

} // namespace kanuka::sl::ir
