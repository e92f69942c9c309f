// Compressed DICOM frames, decompressed by GDCM in processes of their own.
//
// GDCM is not made for damaged or hostile bytes: as Debian compiles it, it ends the process where an assertion fails, it writes to stderr,
// and it may write beyond its buffers. So it runs in a child of this process, which has no open files but its pipe, a limit of memory and a
// time for each frame. The caller always gets pixels or a Status.
#pragma once

#include <sys/types.h>

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "common/base/status.h"
#include "data/volume_io/compressed_frame.h"

namespace slabstream {

// Whether frames of this transfer syntax (UID) can be decompressed.
bool CanDecompress(const std::string& transfer_syntax);
// Their names, for messages.
inline constexpr const char* kCompressions = "JPEG, JPEG Lossless, JPEG-LS, JPEG 2000 (HTJ2K, too) and RLE";

// Processes that decompress frames ahead of the caller. One thread at a time.
class DicomDecoder {
 public:
  // Unavailable: the program is missing, or a process cannot be started.
  static Result<DicomDecoder> Start(std::vector<CompressedFrame> frames);
  DicomDecoder(DicomDecoder&&) = default;
  DicomDecoder& operator=(DicomDecoder&&) = delete;
  ~DicomDecoder();  // ends the processes

  // The next frame: its pixels in this machine's byte order, bits_allocated each. Returns what the codec printed about it, in one line of
  // ASCII: "" if it is content; else the pixels may be damaged. DataLoss: damaged; the message names the file.
  Result<std::string> Read(std::span<std::byte> out);

 private:
  struct Process {
    pid_t pid = -1;
    int pipe = -1;
  };
  DicomDecoder() = default;

  std::vector<CompressedFrame> frames_;
  std::vector<Process> processes_;  // process i has the frames i, i + processes_.size() ...
  std::size_t next_ = 0;
};

}  // namespace slabstream
