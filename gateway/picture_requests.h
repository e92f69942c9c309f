// Requests for pictures in files of any type, and for the command that makes one. All calls on the io thread.
#pragma once

#include "client/pictures/picture_writer.h"
#include "client/request/picture_fields.h"
#include "gateway/requests_under_way.h"

namespace boost::asio {
class thread_pool;
}

namespace slabstream {

class PictureRequests {
 public:
  // All must outlive this. `encoders` compress pictures; at most `most` pictures are under way.
  PictureRequests(boost::asio::io_context& io, boost::asio::thread_pool& encoders, Metrics& metrics, ServiceLink& link, int most)
      : encoders_(encoders), metrics_(metrics), link_(link), under_way_(io, metrics, link, "pictures", most) {}

  void Render(PictureFileType type, Asked asked);
  void Slice(PictureFileType type, Asked asked);
  void Command(const Asked& asked);

 private:
  // Renders the frames, has `encode` make a file of the pictures on an encoder's thread, and replies with it.
  using EncodeFunction = std::function<Result<std::vector<std::byte>>(ServiceLink::Rendered)>;
  void MakeFile(PictureFileType type, Asked asked, std::vector<FrameRequest> frames, const PictureFormat& format, EncodeFunction encode);

  boost::asio::thread_pool& encoders_;
  Metrics& metrics_;
  ServiceLink& link_;
  RequestsUnderWay under_way_;
};

}  // namespace slabstream
