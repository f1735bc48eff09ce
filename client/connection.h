#pragma once

#include <chrono>
#include <string>

namespace binpose::client {

/// How long to wait for a server.
struct Timeouts {
  std::chrono::milliseconds call = std::chrono::seconds(10);      ///< a short call: to get, list or delete models
  std::chrono::milliseconds training = std::chrono::minutes(10);  ///< a whole training
  std::chrono::milliseconds answer = std::chrono::minutes(1);     ///< the next answer on a stream of frames
};

/// How to reach a server.
struct Connection {
  std::string server;         ///< HOST:PORT, or several with commas between: the next is taken where one is lost
  std::string tls_ca = {};    ///< PEM text of the authorities that vouch for the server; empty = plaintext
  std::string tls_cert = {};  ///< PEM text of the certificate that the server asks for; empty = none
  std::string tls_key = {};   ///< PEM text of its key
  std::string token = {};     ///< bearer token; empty = none. In plaintext everybody on the way can read it.
};

/// How often a stream that was lost is opened again, and scans without an answer sent again, before the caller is told.
/// A server that ends on purpose, to be replaced, ends its streams too.
struct Retries {
  int attempts = 8;                               ///< in a row without any answer; 0 = none
  std::chrono::milliseconds first_pause{20};      ///< before the first; each is twice the one before,
  std::chrono::milliseconds longest_pause{2000};  ///< up to this, less a random part of up to a half
};

/// Before attempt 1, 2, ...
std::chrono::milliseconds pause_before(int attempt, const Retries& retries);

}  // namespace binpose::client
