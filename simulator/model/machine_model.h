// MachineModel: the machine that frames are simulated on. It has no render times: the cost of a box is measured (laboratory/measure) and
// comes with the frame. All times are seconds of one thread of a worker.
#pragma once

#include <cstdint>

#include "common/base/status.h"
#include "common/calibration/calibration.h"
#include "simulator/model/link_model.h"

namespace slabstream {

// Costs of a worker's combining thread, for each pixel that is not empty.
struct CombiningCosts {
  double scan_pixel = calibration::combining::kScan;        // searched for runs, empty or not
  double encode_pixel = calibration::combining::kEncode;    // copied into a message
  double combine_pixel = calibration::combining::kCombine;  // from a message, checked, onto what is there
  double local_pixel = calibration::combining::kLocal;      // a pixel of one image of this worker onto another one
  double hidden_pixel = calibration::combining::kHidden;    // a pixel of the frame, searched for opaque tiles (FindHiddenTiles)
  double cipher_byte = 0;         // a byte of a message, encrypted and decrypted again; 0: connections without keys
  std::int32_t run_bytes = 12;    // a run in a message
  std::int32_t rgba_bytes = 16;   // a pixel in a message: splatting, colours as floats
  std::int32_t depth_bytes = 24;  // a pixel in a message: Z-buffer
  // Images are lent: their pixels stay where they are. The thread that owns the sockets announces them itself if the combining thread is
  // idle.
  bool lent = false;
};

// Seconds from one thread's handing something over (a message, a task, a result) until another one has begun with it: to encode and decode
// it, to decide what to do, and to wake a sleeping thread. The same for all threads of the service and its clients.
struct WakeUps {
  double awake = calibration::service::kAwake;    // to a thread that was at work a moment ago
  double asleep = calibration::service::kAsleep;  // to one that has waited `doze` seconds or longer: its core slept or did other work
  double doze = calibration::service::kDoze;
};

// A picture's way: the display worker encrypts it after making it; the coordinator decrypts and encrypts it, and the client decrypts it,
// one picture after the other and beside their other threads. Each does so with the whole picture. A direct one travels to the client
// over one connection. 0: no time, as between the paper's hosts.
struct PictureWay {
  double link_byte = 0;    // to travel over a connection
  double cipher_byte = 0;  // to encrypt or decrypt it
  bool direct = false;
};

struct MachineModel {
  // Between workers. A message between a worker and the coordinator takes only its latency (a picture: its way, too). Wake-ups come on top.
  LinkModel link;
  CombiningCosts combining;
  PictureWay picture;
  WakeUps wake_ups;

  // Workers [i * workers_a_host, ...) share a host. If more threads are busy than it has cores, they share the cores equally; each busy
  // thread besides the first slows the others down by `memory_slowdown`, since they share caches and memory. 0: a host for each worker.
  std::int32_t workers_a_host = 0;
  std::int32_t cores_a_host = 1;
  double memory_slowdown = 0;  // [0, 1)

  double plan_seconds = calibration::service::kPlan;        // the coordinator plans a frame
  double message_seconds = calibration::service::kMessage;  // the coordinator sends or takes a message, one after the other
  double client_seconds = calibration::service::kClient;    // the picture's way from coordinator to client, without wake-up and decoding
};

// InvalidArgument naming field, value and limit.
Status Validate(const MachineModel& machine);

}  // namespace slabstream
