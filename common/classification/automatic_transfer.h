// The automatic transfer function: a useful first picture of an unknown volume, from its histogram alone.
#pragma once

#include "common/classification/transfer_function.h"

namespace slabstream {

// Shows what differs from the background. Opacities and colours are spread over the quantiles of those values: warm colours above the
// background, cold ones below. A ray through an average stretch of material comes out nearly opaque. A volume of one value becomes a
// translucent block. Any summary is fine.
TransferFunction AutomaticTransfer(const VolumeSummary& summary);

}  // namespace slabstream
