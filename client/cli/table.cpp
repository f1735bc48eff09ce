#include "client/cli/table.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <iomanip>
#include <sstream>

namespace binpose::client::cli {
namespace {

bool is_number(const std::string& text) {
  char* end = nullptr;
  std::strtod(text.c_str(), &end);
  return !text.empty() && *end == '\0';
}

}  // namespace

void print(const Table& table, std::ostream& out) {
  if (table.empty()) return;
  const std::size_t column_count = table.front().size();
  std::vector<std::size_t> widths(column_count, 0);
  std::vector<bool> are_numbers(column_count, table.size() > 1);
  for (std::size_t row = 0; row < table.size(); ++row) {
    for (std::size_t column = 0; column < column_count; ++column) {
      widths[column] = std::max(widths[column], table[row][column].size());
      if (row > 0 && !is_number(table[row][column])) are_numbers[column] = false;
    }
  }
  for (const std::vector<std::string>& row : table) {
    std::ostringstream line;
    for (std::size_t column = 0; column < column_count; ++column) {
      line << (column == 0 ? "" : "  ") << (are_numbers[column] ? std::right : std::left)
           << std::setw(static_cast<int>(widths[column])) << row[column];
    }
    std::string text = line.str();
    text.erase(text.find_last_not_of(' ') + 1);
    out << text << '\n';
  }
}

std::string fixed(double number, int digits) {
  std::ostringstream text;
  const double scale = std::pow(10.0, digits);
  text << std::fixed << std::setprecision(digits) << std::round(number * scale) / scale + 0.0;  // never "-0.0"
  return text.str();
}

}  // namespace binpose::client::cli
