#include "client/cli/progress.h"

#include <algorithm>
#include <iostream>

namespace binpose::client::cli {
namespace {

constexpr const char* kClearLine = "\r\033[K";

}  // namespace

void draw_progress(double share, const std::string& text) {
  constexpr int kWidth = 30;
  const int filled = std::clamp(static_cast<int>(share * kWidth), 0, kWidth);
  std::cerr << kClearLine << '[' << std::string(filled, '#') << std::string(kWidth - filled, '.') << "] "
            << static_cast<int>(100 * share) << " % " << text << std::flush;
}

void clear_progress() { std::cerr << kClearLine << std::flush; }

}  // namespace binpose::client::cli
