// Keys of encrypted connections (CurveZMQ, RFC 26): Curve25519 keys as text of 40 characters (Z85, RFC 32).
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace slabstream {

struct KeyPair {
  std::string public_key, secret_key;
  friend bool operator==(const KeyPair&, const KeyPair&) = default;
};

// The public key does not begin with '-', so that no command line takes it for an option.
KeyPair MakeKeyPair();

// Whether the text can be a key.
bool IsKey(std::string_view text);

// The public key that belongs to a secret one; nullopt: `secret_key` is no key.
std::optional<std::string> PublicKeyOf(const std::string& secret_key);

// A short name of a key for people and shells: 8 hexadecimal digits.
std::string IdOfKey(const std::string& public_key);

// What a bound socket needs to take encrypted connections. Who may connect says the context's Authenticator, plane by plane.
struct ServerKeys {
  std::string secret_key;
  std::string plane;    // not empty; a name that no other socket of the context has
  bool sealed = false;  // not CURVE but sealed connections (sealing.h): several times faster, and the socket only receives
};

// What a socket needs to connect to an encrypted one.
struct ClientKeys {
  std::string server_key;  // the public one of whoever listens: anybody else is refused
  KeyPair own;             // sealed: nobody else's, not even another process'; each pair has one connection at a time to one listener
  bool sealed = false;     // as whoever listens has it; the socket only sends, and connects once
};

}  // namespace slabstream
