#pragma once

#include <string>

namespace binpose::client::cli {

/// Draws a bar over the last one on standard error; for terminals only.
///
/// @param share  of the work that is done, in [0, 1].
void draw_progress(double share, const std::string& text);

/// Takes the bar away.
void clear_progress();

}  // namespace binpose::client::cli
