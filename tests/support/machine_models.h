// Machine models for tests.
#pragma once

#include "simulator/model/machine_model.h"

namespace slabstream {

// Nothing takes time but what a test sets.
inline MachineModel WithoutDelays() {
  MachineModel machine;
  machine.link = {Contention::kNone, 0, 1e15};
  machine.combining = {.scan_pixel = 0, .encode_pixel = 0, .combine_pixel = 0, .local_pixel = 0, .hidden_pixel = 0};
  machine.combining.run_bytes = 0;
  machine.wake_ups = {.awake = 0, .asleep = 0};
  machine.plan_seconds = machine.message_seconds = machine.client_seconds = 0;
  return machine;
}

}  // namespace slabstream
