#pragma once

#include <ostream>
#include <string>
#include <vector>

namespace binpose::client::cli {

/// Rows of equal length, the first one the headings.
using Table = std::vector<std::vector<std::string>>;

/// Prints a table with columns that align: texts to the left, numbers to the right.
void print(const Table& table, std::ostream& out);

/// A number with that many digits behind the point.
std::string fixed(double number, int digits);

}  // namespace binpose::client::cli
