// The pictures plane: pictures on their way from display workers straight to a client. The client binds a ROUTER with sealed connections
// and says where with each request (SubmitFrame); display workers connect a DEALER to it. A worker that has no connection to the client
// when a picture is ready sends it through the coordinator.
#pragma once

#include <cstdint>
#include <string>
#include <variant>
#include <vector>

namespace slabstream {

// Where a client takes a picture. Workers connect to the host from which the client has reached the coordinator: to no other one that a
// client may name.
struct PicturesDoor {
  std::uint16_t port = 0;  // not 0
  std::string key;         // the plane's public key
  friend bool operator==(const PicturesDoor&, const PicturesDoor&) = default;
};

// Whom the client is to admit: the workers, by the public keys of their images planes.
struct PictureSenders {
  std::uint64_t version = 1;  // not 0; another one for other keys
  std::vector<std::string> keys;
  friend bool operator==(const PictureSenders&, const PictureSenders&) = default;
};

// What a worker must know to send a client its pictures.
struct PicturesAddress {
  std::string endpoint;
  std::string key;
  friend bool operator==(const PicturesAddress&, const PicturesAddress&) = default;
};

// Payload: the runs of the FrameReply with this digest.
struct SentPicture {
  std::uint64_t digest = 0;  // XXH3-64 of the payload
  std::uint64_t bytes = 0;   // bytes of the payload
  friend bool operator==(const SentPicture&, const SentPicture&) = default;
};

using WorkerToClient = std::variant<SentPicture>;

}  // namespace slabstream
