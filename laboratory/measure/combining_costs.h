// The time that a worker's combining thread takes per pixel, measured by running its operators in this process.
#pragma once

#include "common/image/pixel_format.h"
#include "simulator/model/machine_model.h"

namespace slabstream {

// How the pixels of a partial image travel from one worker to another.
enum class ImageTransfer {
  kLent,     // between workers of one host: they stay where they are and are read there
  kMessage,  // between hosts: as runs, in the message
};

// Processor time, medians of several runs on pictures that are full and half empty. As in frames, the pixels are not in this core's caches
// (incoming ones were written by another core, and rendering has run on this one since), and an image becomes as large as the frame when
// the first other one is combined into it. The costs of finding hidden tiles are those of colour images; others have none.
CombiningCosts MeasureCombining(ImageTransfer transfer, PixelFormat format = PixelFormat::kRgba);

}  // namespace slabstream
