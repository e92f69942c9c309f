// What the colour bar and the legend of a picture say, from its request and what the service knows of its dataset. Pure.
#pragma once

#include "client/pictures/picture_writer.h"
#include "common/frame/frame_request.h"
#include "common/wire/client_messages.h"

namespace slabstream {

// `summary`: of the request's dataset, under its transfer function. No bar if all values have one colour or none is visible. Entries are
// the labels that are shown, those without a name by their number, and then the isosurfaces by their values.
PictureKey KeyOf(const FrameRequest& request, const SummaryReply& summary);

}  // namespace slabstream
