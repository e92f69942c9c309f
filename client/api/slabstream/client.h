// The client library of Slabstream: asks a service that runs for pictures of its datasets.
//
//   #include <slabstream/client.h>
//
//   slabstream::Service service = slabstream::Service::Connect({"tcp://127.0.0.1:7420"});
//   slabstream::Image image = service.Render("brain", {{"azimuth", "30"}, {"size", "800x600"}});
//   image.Save("brain.png");
//
// C++17. CMake: find_package(Slabstream) and the target Slabstream::client; pkg-config: slabstream (docs/cpp.md).
//
// Errors: functions throw Error, and std::bad_alloc if this process has no memory left. No function ends the process or prints anything.
// Threads: each class says what threads may do with it.
#pragma once

#include <chrono>
#include <cstddef>
#include <functional>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#define SLABSTREAM_API __attribute__((visibility("default")))

namespace slabstream {
inline namespace v0 {

// Why something failed.
enum class ErrorCode : int {
  kInvalidArgument = 1,    // an argument, an option or its text is wrong
  kNotFound = 2,           // a dataset, a file or a font does not exist
  kUnavailable = 3,        // nobody answers, there is no worker, the service is gone or refuses the key; a file cannot be written
  kResourceExhausted = 4,  // too large, or too many requests
  kDataLoss = 5,           // a message or a file is damaged
  kCancelled = 6,          // Cancellation::Cancel
  kDeadlineExceeded = 7,   // time ran out
  kInternal = 8,           // a mistake of Slabstream
};

// what(): one line that names the value that was met and what is expected, to be shown as it is.
class SLABSTREAM_API Error : public std::runtime_error {
 public:
  Error(ErrorCode code, const std::string& message);
  Error(const Error&) noexcept;
  ~Error() override;
  ErrorCode code() const noexcept { return code_; }

 private:
  ErrorCode code_;
};

// Options by name and text, as on the command line but without dashes: {"azimuth", "30"} says what --azimuth 30 says. A flag has the text
// "true" or "false". An option that may be repeated may stand there several times. All of `slabstream render --help` that say what a
// picture shows; none names a file: "transfer" takes a preset or the JSON of a colour map.
using Options = std::vector<std::pair<std::string, std::string>>;

// Where a service is. With both, the endpoint is another way to the service of the file. With neither: the file that $SLABSTREAM_SERVICE
// names, else $SLABSTREAM_ENDPOINT, else the service that `slabstream up` of this user started here last.
struct Address {
  std::string endpoint = {};      // "tcp://HOST:PORT" or "ipc://PATH"
  std::string service_file = {};  // with the keys of a service that has some, such as "client.json"; connections are encrypted then
};

// How far a request has come.
struct Progress {
  enum class Phase { kQueued = 1, kLoading = 2, kRunning = 3 };
  Phase phase = Phase::kQueued;
  int queue_position = 0;                // kQueued: frames before this one
  int read_percent = 0;                  // kLoading: of the dataset, [0, 100]
  int groups_done = 0, group_count = 0;  // kRunning: parts of the picture; 0 of 0: not known yet
  int workers = 0;                       // workers that share the frame
};

// A picture, immutable. Copies share the pixels. Any thread.
class SLABSTREAM_API Image {
 public:
  Image(const Image&) noexcept;
  Image& operator=(const Image&) noexcept;
  ~Image();

  int width() const noexcept;   // pixels
  int height() const noexcept;  // pixels

  // 4 * width * height floats: premultiplied linear R, G, B, A of each pixel, row 0 at the top, without padding. A in [0, 1]. As it was
  // rendered: without background and annotations.
  std::vector<float> Rgba() const;
  // width * height floats: distance from the camera, +infinity where nothing is seen. Empty if the renderer makes none.
  std::vector<float> Depth() const;

  // The bytes of a PNG file, over the background and under the annotations that options ask for: those of `slabstream render`.
  std::vector<std::byte> Png() const;
  // The bytes of a JPEG file, made like that PNG file; where the picture is transparent, it lies over black. `quality`
  // in [1, 100], else InvalidArgument.
  std::vector<std::byte> Jpeg(int quality = 90) const;
  // Writes a .png, .jpg, .webp, .tif, .exr (with the floats and depths), .pdf or .svg file. It appears whole or not at all.
  // InvalidArgument: another ending. Unavailable: it cannot be written, or libslabstream-pictures.so is missing, which writes the last
  // four.
  void Save(const std::string& path) const;

  bool final() const noexcept;  // false: a preview, of groups_done() of group_count() parts of the volume
  int groups_done() const noexcept;
  int group_count() const noexcept;
  std::chrono::nanoseconds latency() const noexcept;  // from the request to the last byte, measured here; 0 of a preview

 private:
  friend class Service;
  struct Impl;
  explicit Image(std::shared_ptr<const Impl> impl) noexcept;
  std::shared_ptr<const Impl> impl_;
};

// Ends calls early. Copies mean the same calls. Any thread, and signal handlers.
class SLABSTREAM_API Cancellation {
 public:
  Cancellation();
  Cancellation(const Cancellation&) noexcept;
  Cancellation& operator=(const Cancellation&) noexcept;
  ~Cancellation();

  void Cancel() const noexcept;  // calls that have it throw Error (kCancelled) within 50 ms; it cannot be undone
  bool cancelled() const noexcept;

 private:
  struct Impl;
  std::shared_ptr<Impl> impl_;
};

// What a call of Render may have beside its options. Both functions are called by the thread that called Render, while it waits; they must
// not call the same Service. What they throw cancels the request and leaves Render.
struct RenderCall {
  std::chrono::milliseconds deadline = std::chrono::minutes(10);  // [1 ms, 24 h], from the request's arrival at the service
  Cancellation cancellation = {};
  std::function<void(const Progress&)> on_progress = {};  // whenever something happens
  std::function<void(const Image&)> on_preview = {};      // a picture after each part but the last one; none: no previews are made
};

// A connection to a service. Any thread; calls wait for each other, so pictures that are to be made at the same time need a Service each.
class SLABSTREAM_API Service {
 public:
  // Unavailable: nobody answers within `timeout`, or the service refuses the key. InvalidArgument, NotFound: the endpoint or the file is
  // wrong.
  static Service Connect(const Address& address = {}, std::chrono::milliseconds timeout = std::chrono::seconds(4));
  Service(Service&&) noexcept;
  Service& operator=(Service&&) noexcept;
  ~Service();

  // Waits for the picture. InvalidArgument: an option. NotFound: the dataset. Unavailable: the service stopped answering.
  // ResourceExhausted, DataLoss, DeadlineExceeded, Cancelled.
  Image Render(const std::string& dataset, const Options& options = {}, const RenderCall& call = {});

  // Changes parameters of the simulation that holds a dataset, all or none; its next steps have them. NotFound: the dataset.
  // InvalidArgument: no simulation holds it, or a name or value is wrong. Unavailable.
  void Steer(const std::string& dataset, const std::vector<std::pair<std::string, double>>& values);

  std::vector<std::string> Datasets();  // names, those of the catalogue in its order
  std::string StatusJson();             // the object that `slabstream status --json` prints; UTF-8

 private:
  struct Impl;
  explicit Service(std::unique_ptr<Impl> impl) noexcept;
  std::unique_ptr<Impl> impl_;
};

}  // namespace v0
}  // namespace slabstream
