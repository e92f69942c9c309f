// The key of a command's pictures.
#pragma once

#include "client/client.h"
#include "client/pictures/picture_writer.h"
#include "client/request/key_of_picture.h"

namespace slabstream {

// Asks the service for what annotations need, of pictures like that of `request`. Empty if they need nothing.
inline Result<PictureKey> KeyFor(Client& client, const Annotations& annotations, const FrameRequest& request) {
  if (!annotations.needs_key()) return PictureKey();
  const Result<SummaryReply> summary = client.Summarize(request.dataset, request.transfer);
  if (!summary.ok()) return summary.status();
  return KeyOf(request, *summary);
}

}  // namespace slabstream
