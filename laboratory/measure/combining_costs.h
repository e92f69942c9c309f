// What the combining thread of a worker takes for pixels, measured by running its operators in this process.
#pragma once

#include "common/simulation/machine_model.h"

namespace slabstream {

// How the pixels of a partial image get from one worker to another.
enum class Transfer {
  kLent,     // workers of one host: they stay where they are and are read there
  kMessage,  // between hosts: as runs, in the message
};

// Processor time, medians of several runs on pictures that are full and half empty. As in frames they are not in this core's caches (what
// arrives was written by another one, and rendering has been through here since), and an image becomes as large as the frame when the first
// other one is combined onto it.
CombiningCosts MeasureCombining(Transfer transfer);

}  // namespace slabstream
