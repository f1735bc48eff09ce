#pragma once

#include <string_view>

namespace binpose::client {

/// The page that build.mjs bundled, with {{DATA}} where the data go; empty when the build had no npm.
std::string_view viewer_page();

}  // namespace binpose::client
