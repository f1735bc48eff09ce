#pragma once

#include <string>

namespace binpose::server {

/// A connected TCP socket that has not said anything yet; the caller closes it.
int connect_to(const std::string& address);

/// The whole answer, head and body, to a GET.
///
/// @param address  IPv4 HOST:PORT.
std::string http_get(const std::string& address, const std::string& path);

}  // namespace binpose::server
